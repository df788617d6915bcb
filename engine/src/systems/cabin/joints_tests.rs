//! The joints' geometry against itself and against differences.

use super::*;
use crate::systems::cabin::instrument::tests::example;

#[test]
fn a_seat_is_found_from_its_legs_and_changes_with_them_as_differences_say() {
    let joints = Joints::new(&example());
    let rest = joints.at_rest().unwrap();
    let t_r = rest.t_r + Vector3::new(0.08, -0.05, 0.06);
    let c_rp = cayley(&Vector3::new(0.1, -0.07, 0.12));
    let (legs, _) = joints.legs(&t_r, &c_rp);
    let seat = joints.seat(&legs, &rest).unwrap();
    assert!((seat.t_r - t_r).norm() < 1e-9 && (seat.c_rp - c_rp).norm() < 1e-9);

    let point_p = Vector3::new(0.3, 1.7, -0.4);
    let (here, by_legs) = joints.in_cabin(0.05, -0.11, &seat).point(&point_p);
    for leg in 0..6 {
        let mut longer = legs;
        longer[leg] += 1e-5;
        let moved = joints.seat(&longer, &seat).unwrap();
        let (there, _) = joints.in_cabin(0.05, -0.11, &moved).point(&point_p);
        assert!(((there - here) / 1e-5 - by_legs.column(leg)).norm() < 1e-4, "leg {leg}");
    }
}

#[test]
fn legs_in_millimetres_or_far_out_of_reach_have_no_seat() {
    let joints = Joints::new(&example());
    let rest = joints.at_rest().unwrap();
    let (legs, _) = joints.legs(&rest.t_r, &rest.c_rp);
    let mut in_millimetres = legs;
    in_millimetres[2] *= 1000.0;
    assert!(joints.seat(&in_millimetres, &rest).is_none());
    assert!(joints.seat(&(legs * 0.1), &rest).is_none());
    assert!(joints.seat(&(legs * f64::NAN), &rest).is_none());
}
