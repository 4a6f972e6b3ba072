// The exact star discrepancy of a set of points.
use raystone::discrepancy::{Budget, PointSet, star};
fn main() {
    let points = PointSet::new(2, vec![0.25, 0.25, 0.75, 0.75]).expect("points of the unit square");
    println!("D* = {:?}", star(&points, &Budget::seconds(1.0)).value());
}
