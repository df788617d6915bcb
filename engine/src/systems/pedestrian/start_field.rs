//! Is the field that the standing start has seen that of the site? Dip and strength need no heading.

use super::contradictions::Contradiction;
use crate::geo::SiteField;
use crate::ins::alignment::StandingStart;

/// A dip as far the other way as this is the site's with the other sign, rad: iron turns a field by less.
const SAME_DIP_RAD: f64 = 0.26;
/// … where the site's is steeper than this, rad: at the magnetic equator a sign does not show.
const STEEP_RAD: f64 = 0.2;
/// Off by more than this share of the site's field, it tells no direction.
const USELESS_SHARE: f64 = 0.4;
/// Off by less than this nothing is special, µT: a shoe's iron and a field under a steel roof.
const USUAL_UT: f64 = 4.0;

/// What the first field is worth.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum FirstField {
    /// It is the site's as far as it can be seen.
    Usual,
    /// It is off by so much that it may be turned by this, rad.
    Disturbed(f64),
    /// It says nothing of where north is.
    Useless(Contradiction),
}

/// Judges the mean field of a standing start by that of the site.
pub(crate) fn first_field(start: &StandingStart, site: Option<&SiteField>) -> FirstField {
    let (Some(site), Some(mag_b_ut), true) = (site, start.mag_b_ut, start.still) else {
        return FirstField::Usual;
    };
    let (found_ut, force_m_s2) = (mag_b_ut.norm(), start.f_b.norm());
    if found_ut <= 0.0 || force_m_s2 <= 0.0 {
        return FirstField::Usual;
    }
    let down_ut = -mag_b_ut.dot(&start.f_b) / force_m_s2;
    let dip_rad = libm::asin((down_ut / found_ut).clamp(-1.0, 1.0));
    let level_ut = (found_ut * found_ut - down_ut * down_ut).max(0.0).sqrt();
    let off_ut = libm::hypot(level_ut - site.horizontal_ut(), down_ut - site.down_ut());
    let (dip_deg, site_dip_deg) = (dip_rad.to_degrees(), site.dip_rad.to_degrees());
    let of_its_strength = (found_ut - site.strength_ut).abs() < USELESS_SHARE * site.strength_ut;
    if site.dip_rad.abs() > STEEP_RAD && of_its_strength && (dip_rad + site.dip_rad).abs() < SAME_DIP_RAD {
        return FirstField::Useless(Contradiction::FieldUpsideDown { dip_deg, site_dip_deg });
    }
    if off_ut > USELESS_SHARE * site.strength_ut {
        let site_ut = site.strength_ut;
        let cause = Contradiction::FieldOfAnotherPlace { dip_deg, site_dip_deg, found_ut, site_ut };
        return FirstField::Useless(cause);
    }
    if off_ut > USUAL_UT {
        return FirstField::Disturbed(off_ut / site.horizontal_ut().max(1.0));
    }
    FirstField::Usual
}
