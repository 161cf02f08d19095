use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::Text;
use crate::bytes::impl_bytes;

/// A sentence of a teacher.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Utterance/1")]
pub struct Utterance {
    /// The speaker: partner 1, 2, …
    pub speaker: u32,
    /// The sentence.
    pub text: Text,
}

impl_bytes!(Utterance = "leo/Utterance/1" {
    speaker, text
});
