//! The words of this room: jobs, batches, keys, kinds and options as types that need no store and no worker. Every other folder may use them.

/// Gives an enum the list of its values and their names in the database, the API and the logs.
macro_rules! names {
    ($vis:vis $type:ident { $($value:ident = $name:literal),* $(,)? }) => {
        impl $type {
            /// Every value, in the order of their declaration.
            $vis const ALL: [$type; [$($name),*].len()] = [$($type::$value),*];

            /// The name in the database, the API and the logs.
            #[must_use]
            $vis fn name(self) -> &'static str {
                match self {
                    $($type::$value => $name,)*
                }
            }

            /// The value of this name.
            #[must_use]
            $vis fn from_name(name: &str) -> Option<$type> {
                $type::ALL.into_iter().find(|value| value.name() == name)
            }
        }
    };
}

pub(crate) use names;

pub mod batch;
pub mod job;
pub mod key;
pub mod kind;
pub mod labels;
pub mod submit_options;
