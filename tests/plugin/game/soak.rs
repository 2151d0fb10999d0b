//! Random changes: every object is drawn whole and once.

use fieldlod_tests::soak::Soak;

#[test]
fn random_world_is_drawn_whole() {
    for seed in [1, 2] {
        let mut soak = Soak::new(seed);
        let before = soak.counts();
        soak.fill();
        (0..300).for_each(|_| soak.step());
        assert!(soak.units_drawn > 200, "{}", soak.units_drawn);
        soak.clear();
        assert_eq!(soak.counts(), before, "seed {seed}");
    }
}
