//! Bits of groups, 64 to a word, and bits of eight lanes.

/// Number of items that a loop handles at once.
pub const LANES: usize = 8;
/// Groups in a chunk: the bits of one word.
pub(crate) const CHUNK: usize = 64;

/// The indices of the bits that are set, ascending.
pub(crate) fn set_bits(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    let in_word = |(index, &word)| set_bits_of(word).map(move |bit| index * CHUNK + bit);
    words.iter().enumerate().flat_map(in_word)
}

/// The indices of the bits of one word that are set, ascending.
#[inline]
pub(crate) fn set_bits_of(word: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut rest: u64 = word.into();
    std::iter::from_fn(move || {
        let bit = (rest != 0).then(|| rest.trailing_zeros() as usize)?;
        rest &= rest - 1;
        Some(bit)
    })
}

/// Whether a bit is set; bits beyond the end are not set.
#[inline]
pub(crate) fn is_set(words: &[u64], bit: usize) -> bool {
    let word = words.get(bit / CHUNK);
    word.is_some_and(|word| word >> (bit % CHUNK) & 1 == 1)
}

/// The eight bits of a block, given its place in its word.
#[inline]
pub(crate) fn block_bits(word: u64, index: usize) -> u32 {
    (word >> (index * LANES)) as u32 & 0xff
}

/// One bit for each lane that is 1.
#[inline(always)]
pub fn lane_bits(lanes: &[u8; LANES]) -> u32 {
    (0..LANES).fold(0, |bits, lane| bits | u32::from(lanes[lane]) << lane)
}
