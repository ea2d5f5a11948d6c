//! The search for numbers of an answer that are not finite.

/// A type that may contain numbers.
pub trait Finite {
    /// Returns the path to the first number that is not finite.
    fn not_finite(&self) -> Option<String>;
}

impl Finite for f64 {
    fn not_finite(&self) -> Option<String> {
        (!self.is_finite()).then(String::new)
    }
}

macro_rules! without_fractions {
    ($($kind:ty),+) => {
        $(impl Finite for $kind {
            fn not_finite(&self) -> Option<String> {
                None
            }
        })+
    };
}

without_fractions!(bool, u32, usize, String);

impl<T: Finite> Finite for Option<T> {
    fn not_finite(&self) -> Option<String> {
        self.as_ref()?.not_finite()
    }
}

impl<T: Finite> Finite for Box<T> {
    fn not_finite(&self) -> Option<String> {
        (**self).not_finite()
    }
}

impl<T: Finite> Finite for Vec<T> {
    fn not_finite(&self) -> Option<String> {
        let mut items = self.iter().enumerate();
        items.find_map(|(k, item)| Some(format!("[{k}]{}", item.not_finite()?)))
    }
}

impl<T: Finite + Clone, const N: usize> Finite for [T; N] {
    fn not_finite(&self) -> Option<String> {
        self.to_vec().not_finite()
    }
}

#[cfg(test)]
mod tests {
    use railhead_macros::Finite;

    use super::Finite;

    #[derive(Finite)]
    struct Inner {
        pair: [f64; 2],
        maybe: Option<f64>,
    }

    #[derive(Finite)]
    struct Outer {
        word: String,
        list: Vec<Inner>,
    }

    fn path(pair: [f64; 2], maybe: Option<f64>) -> Option<String> {
        let inner = |pair, maybe| Inner { pair, maybe };
        let outer = Outer {
            word: "NaN".to_owned(),
            list: vec![inner([0.0; 2], None), inner(pair, maybe)],
        };
        outer.not_finite()
    }

    #[test]
    fn the_first_number_that_is_not_finite_is_named() {
        assert_eq!(path([1.0, -0.0], Some(f64::MAX)), None);
        assert_eq!(path([1.0, 0.0], None), None);
        let in_pair = path([1.0, f64::NAN], None);
        assert_eq!(in_pair.as_deref(), Some(".list[1].pair[1]"));
        let in_maybe = path([1.0; 2], Some(f64::INFINITY));
        assert_eq!(in_maybe.as_deref(), Some(".list[1].maybe"));
    }
}
