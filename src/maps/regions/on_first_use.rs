use std::sync::OnceLock;

/// A value that is computed on first use. It is derived from other data, so it is ignored by comparisons.
#[derive(Clone, Debug)]
pub(crate) struct OnFirstUse<T>(OnceLock<T>);

impl<T> OnFirstUse<T> {
    /// The value, if it is computed.
    #[inline]
    pub(crate) fn get(&self) -> Option<&T> {
        self.0.get()
    }

    /// The value. `make` computes it and must always return the same value.
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
