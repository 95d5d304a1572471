//! The simulation against a plain loop over arrays of the same mathematics, which shares numerics only.

use std::path::PathBuf;
use tropism::scenario::load::Request;
use tropism::study::bench::bench;
use tropism::study::laboratory::Laboratory;
use tropism::systems;

#[test]
fn the_cones_of_the_simulation_end_where_those_of_a_plain_loop_end() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenarios/load.json");
    let set = ["/time/duration=3", "/populations/axons/births/uniform/to=1"].map(str::to_owned).to_vec();
    let request = Request { path, set, ..Request::default() };
    let roster = systems::standard();
    let found = bench(&Laboratory::new(&request, &roster), &[60, 400], &|_| {}).unwrap();
    assert_eq!(found.without_plain, None);
    for row in &found.rows {
        // Sums in another order: round-off, which contact makes a little larger in three hours.
        assert!(row.difference.unwrap() < 1e-9, "{} axons: {:?} um", row.axons, row.difference);
        assert!(row.cone_steps > 20 * row.axons && row.ratio.unwrap() > 0.0);
    }
}
