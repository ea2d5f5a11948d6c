//! Severity, figures and rounded numbers of remarks, and the macro that generates the enum of remarks from their list.

use railhead_macros::keyword;
use std::borrow::Borrow;
use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// How much attention a remark needs.
#[keyword]
pub enum Severity {
    /// A fact about the answer; nothing needs to be done.
    Info,
    /// The numbers need care; `advice` of the code explains it.
    Warning,
}

/// One kind of remark, explained.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RemarkKind {
    /// The `code` of remarks of this kind; it never changes.
    #[schema(value_type = String, example = "friction-unusual")]
    pub code: &'static str,
    /// How much attention it needs.
    pub severity: Severity,
    /// What it means.
    #[schema(value_type = String)]
    pub meaning: &'static str,
    /// What to do about it.
    #[schema(value_type = String)]
    pub advice: &'static str,
    /// Names of the values in its sentence.
    #[schema(value_type = Vec<String>)]
    pub figures: &'static [&'static str],
    /// The `detail` of a remark of this kind with figures made up.
    pub example: String,
}

/// A value in a remark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub enum Figure {
    /// A finite number.
    Number(f64),
    /// Several numbers.
    Numbers(Vec<f64>),
    /// A word.
    Word(String),
}

/// Types that can be a figure of a remark.
pub(crate) trait AsFigure {
    /// The figure; `None` for a number that is absent or not finite.
    fn figure(&self) -> Option<Figure>;
}

impl AsFigure for [f64; 2] {
    fn figure(&self) -> Option<Figure> {
        let finite = self.iter().all(|part| part.is_finite());
        finite.then(|| Figure::Numbers(self.to_vec()))
    }
}

impl AsFigure for &'static str {
    fn figure(&self) -> Option<Figure> {
        Some(Figure::Word((*self).to_owned()))
    }
}

/// A number that is displayed with a number of significant digits.
#[derive(Debug, Clone, Copy)]
pub struct Rounded(pub f64, pub i32);

/// Displays a number with three significant digits.
pub fn short(value: impl Borrow<f64>) -> Rounded {
    Rounded(*value.borrow(), 3)
}

/// Displays a ratio in per cent with three significant digits.
pub(crate) fn percent(ratio: impl Borrow<f64>) -> Rounded {
    short(100.0 * ratio.borrow())
}

/// Displays a range with one decimal.
pub(crate) fn span([low, high]: &[f64; 2]) -> String {
    format!("{low:.1} to {high:.1}")
}

/// Range of decimal exponents of numbers that are displayed without an exponent.
const PLAIN: std::ops::Range<i32> = -4..7;

impl Display for Rounded {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        let Rounded(value, digits) = *self;
        let exponent = value.abs().log10().floor() as i32;
        if value == 0.0 || !value.is_finite() {
            write!(out, "{value}")
        } else if PLAIN.contains(&exponent) {
            let scale = 10_f64.powi(digits - 1 - exponent);
            let decimals = usize::try_from(digits - 1 - exponent).unwrap_or(0);
            let text = format!("{:.decimals$}", (value * scale).round() / scale);
            out.write_str(match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.'),
                false => &text,
            })
        } else {
            let decimals = usize::try_from(digits - 1).unwrap_or(0);
            write!(out, "{value:.decimals$e}")
        }
    }
}

/// Declares the enum `Remark`. The documentation of a variant is the explanation that clients read, and its name in kebab case is its code.
/// Every figure has a value for the example. `detail` forms the sentence from references to the figures: it is a format string with their
/// names, the arguments of `format!` in parentheses, or a block. A figure with `@short`, `@percent` or `@span` denotes its rounded value there.
macro_rules! remarks {
    ($(
        $(#[doc = $meaning:literal])+
        $severity:ident $name:ident {
            $( $(#[doc = $about:literal])+ $figure:ident: $(@ $display:ident)? $kind:ty = $example:expr, )*
        }
        advice: $advice:literal,
        detail: $($text:literal)? $(( $($format:tt)+ ))? $({ $($sentence:tt)+ })?,
    )+) => {
        /// A remark on an answer.
        #[derive(Debug, Clone, PartialEq, railhead_macros::Code)]
        pub enum Remark {
            $(
                $(#[doc = $meaning])+
                $name {
                    $( $(#[doc = $about])+ $figure: $kind, )*
                },
            )+
        }

        impl Remark {
            /// The severity of the remark.
            pub fn severity(&self) -> Severity {
                match self { $( Remark::$name { .. } => Severity::$severity, )+ }
            }

            /// Returns the sentence with the figures.
            #[allow(
                unused_variables,
                clippy::useless_format,
                reason = "not every sentence names all figures, and some name none"
            )]
            pub fn detail(&self) -> String {
                match self {
                    $( Remark::$name { $($figure),* } => {
                        $( $( let $figure = $display($figure); )? )*
                        $( format!($text) )? $( format!($($format)+) )? $( $($sentence)+ )?
                    } )+
                }
            }

            /// Returns the figures by name, without those that are not finite.
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

            /// Returns one remark of each kind with the figures of its example.
            pub fn examples() -> Vec<Remark> {
                vec![ $( Remark::$name { $($figure: $example),* }, )+ ]
            }

            /// Returns all kinds with their explanations, in the order of the list.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_usual_size_have_no_exponent() {
        let text = |value| Rounded(value, 3).to_string();
        assert_eq!(text(0.19764), "0.198");
        assert_eq!(text(6973.3), "6970");
        assert_eq!(text(-0.5), "-0.5");
        assert_eq!(text(460.0), "460");
        assert_eq!(text(9.999), "10");
        assert_eq!(text(0.00012345), "0.000123");
        assert_eq!(text(0.0), "0");
        assert_eq!(text(1.5e-9), "1.50e-9");
        assert_eq!(text(-2.5e12), "-2.50e12");
        assert_eq!(text(f64::INFINITY), "inf");
    }
}
