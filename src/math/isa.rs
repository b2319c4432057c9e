//! The instruction set that a hot loop is compiled for, chosen when the program runs.
//!
//! A kernel is written once, in plain Rust over slices and arrays, and run by [`Isa::run`], which
//! compiles it again for each instruction set. Nothing is fused or reassociated on the way, so that
//! every one of them gives the same bits.

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Isa {
    /// What the program was built for.
    Portable,
    /// x86-64 with AVX2 and BMI.
    Avx2,
    /// x86-64 with the AVX-512 of servers since 2017: F, BW, DQ, VL, CD.
    Avx512,
}

impl Isa {
    const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The widest one that this machine has.
    #[must_use]
    pub fn best() -> Self {
        Self::available().last().unwrap_or(Self::Portable)
    }

    /// All that this machine has, narrow ones first.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|isa| isa.is_available())
    }

    /// Whether this machine has it.
    #[must_use]
    #[inline]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                std::is_x86_feature_detected!("avx2")
                    && std::is_x86_feature_detected!("bmi1")
                    && std::is_x86_feature_detected!("bmi2")
                    && std::is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && std::is_x86_feature_detected!("avx512f")
                    && std::is_x86_feature_detected!("avx512bw")
                    && std::is_x86_feature_detected!("avx512cd")
                    && std::is_x86_feature_detected!("avx512dq")
                    && std::is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Runs a kernel compiled for this instruction set; for [`Isa::Portable`] where the machine has
    /// it not. What the kernel calls must be `#[inline(always)]`, or it stays as the program was
    /// built.
    #[inline(always)]
    pub fn run<R>(self, kernel: impl FnOnce() -> R) -> R {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 if self.is_available() => {
                // SAFETY: the machine has what the function is compiled for.
                unsafe { run_avx2(kernel) }
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 if self.is_available() => {
                // SAFETY: the machine has what the function is compiled for.
                unsafe { run_avx512(kernel) }
            }
            _ => kernel(),
        }
    }
}

/// # Safety
/// The machine must have the features that are named.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,popcnt")]
unsafe fn run_avx2<R>(kernel: impl FnOnce() -> R) -> R {
    kernel()
}

/// # Safety
/// The machine must have the features that are named.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,popcnt,avx512f,avx512bw,avx512cd,avx512dq,avx512vl")]
unsafe fn run_avx512<R>(kernel: impl FnOnce() -> R) -> R {
    kernel()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let values: Vec<f32> = (0..1003).map(|i| (i as f32 * 0.37).sin()).collect();
        let sums = |isa: Isa| {
            isa.run(|| {
                let mut sums = [0.0f32; 16];
                for chunk in values.chunks_exact(16) {
                    for (sum, value) in sums.iter_mut().zip(chunk) {
                        *sum += value * value;
                    }
                }
                sums
            })
        };
        for isa in Isa::available() {
            assert_eq!(sums(isa), sums(Isa::Portable), "{isa:?}");
        }
    }

    #[test]
    fn an_instruction_set_that_is_not_there_falls_back() {
        for isa in Isa::ALL {
            assert_eq!(isa.run(|| 6 * 7), 42);
        }
    }
}
