use std::sync::OnceLock;

/// A value that is computed when it is first asked for. It follows from what stands beside it, so that any two are equal.
#[derive(Clone, Debug)]
pub(crate) struct OnFirstUse<T>(OnceLock<T>);

impl<T> OnFirstUse<T> {
    /// A value that is known.
    pub(crate) fn known(value: T) -> Self {
        Self(OnceLock::from(value))
    }

    /// The value, if it is there.
    #[inline]
    pub(crate) fn get(&self) -> Option<&T> {
        self.0.get()
    }

    /// The value. `make` must give the same whenever it is called.
    #[inline]
    pub(crate) fn get_or_make(&self, make: impl FnOnce() -> T) -> &T {
        self.0.get_or_init(make)
    }
}

impl<T> Default for OnFirstUse<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T> PartialEq for OnFirstUse<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
