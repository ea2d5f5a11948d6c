//! The macro that generates the enum of remarks, with their codes, severities, sentences and explanations, from one list.

/// Declares the enum `Remark`. The documentation of a variant is the explanation that clients read; every figure has a value for the
/// example; `detail` is an expression that forms the sentence from references to the figures.
macro_rules! remarks {
    (; $(
        $(#[doc = $meaning:literal])+
        $name:ident {
            $( $(#[doc = $about:literal])+ $figure:ident: $kind:ty = $example:expr, )*
        }
        code: $code:literal,
        severity: $severity:ident,
        advice: $advice:literal,
        detail: $detail:expr,
    )+) => {
        /// Something a client should know about an answer.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Remark {
            $(
                $(#[doc = $meaning])+
                $name {
                    $( $(#[doc = $about])+ $figure: $kind, )*
                },
            )+
        }

        impl Remark {
            /// The stable code of this kind of remark, as clients filter by it.
            #[must_use]
            pub fn code(&self) -> &'static str {
                match self { $( Remark::$name { .. } => $code, )+ }
            }

            /// How much it asks of the client.
            #[must_use]
            pub fn severity(&self) -> Severity {
                match self { $( Remark::$name { .. } => Severity::$severity, )+ }
            }

            /// The sentence with the figures of this occurrence.
            #[must_use]
            #[allow(
                unused_variables,
                clippy::useless_format,
                reason = "not every sentence names all figures, and some name none"
            )]
            pub fn detail(&self) -> String {
                match self { $( Remark::$name { $($figure),* } => $detail, )+ }
            }

            /// The figures by name; one that is no finite number is left out.
            #[must_use]
            pub fn figures(&self) -> BTreeMap<String, Figure> {
                let all: Vec<(&str, Option<Figure>)> = match self {
                    $( Remark::$name { $($figure),* } => vec![
                        $( (stringify!($figure), AsFigure::figure($figure)), )*
                    ], )+
                };
                all.into_iter()
                    .filter_map(|(name, figure)| Some((name.to_owned(), figure?)))
                    .collect()
            }

            /// One remark of each kind, with invented figures.
            #[must_use]
            pub fn examples() -> Vec<Remark> {
                vec![ $( Remark::$name { $($figure: $example),* }, )+ ]
            }

            /// Every kind, explained, in the order of the list.
            #[must_use]
            pub fn kinds() -> Vec<RemarkKind> {
                let said: &[(&str, &str, &[&str])] = &[ $(
                    (concat!($($meaning),+), $advice, &[ $(stringify!($figure)),* ]),
                )+ ];
                Remark::examples()
                    .iter()
                    .zip(said)
                    .map(|(example, (meaning, advice, figures))| RemarkKind {
                        code: example.code(),
                        severity: example.severity(),
                        meaning: meaning.trim(),
                        advice,
                        figures,
                        example: example.detail(),
                    })
                    .collect()
            }
        }
    };
}
pub(crate) use remarks;
