//! The list of aids on the command line.

use lodestep_engine::systems::pedestrian::Aids;

/// The names that `--aid` knows.
pub(super) const NAMES: &str = "zupt, heading, maru, separation, markers, altimeter";

/// `zupt,heading,…`, or `none` for the strapdown alone.
pub(super) fn parse(list: &str) -> Result<Aids, String> {
    let mut aids = Aids {
        zupt: false,
        heading: false,
        maru: false,
        separation: false,
        markers: false,
        altimeter: false,
    };
    if list.trim() == "none" {
        return Ok(aids);
    }
    for name in list.split(',').map(str::trim) {
        let aid = match name {
            "zupt" => &mut aids.zupt,
            "heading" => &mut aids.heading,
            "maru" => &mut aids.maru,
            "separation" => &mut aids.separation,
            "markers" => &mut aids.markers,
            "altimeter" => &mut aids.altimeter,
            _ => return Err(format!("there is no aid {name:?}: choose from {NAMES}, or write none")),
        };
        if *aid {
            return Err(format!("the aid {name:?} is there twice: name each once"));
        }
        *aid = true;
    }
    Ok(aids)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_listed_aids_are_on_and_no_others() {
        let aids = parse("zupt, maru").unwrap();
        assert!(aids.zupt && aids.maru);
        assert!(!(aids.heading || aids.separation || aids.markers || aids.altimeter));
        assert!(!parse("none").unwrap().zupt);
        assert_eq!(parse("zupt,heading,maru,separation,markers,altimeter").unwrap(), Aids::default());
    }

    #[test]
    fn what_is_unknown_is_named() {
        assert_eq!(
            parse("zupt,gps").unwrap_err(),
            "there is no aid \"gps\": choose from zupt, heading, maru, separation, markers, altimeter, or write none"
        );
        assert!(parse("").unwrap_err().contains("there is no aid \"\""));
        assert!(parse("zupt,zupt").unwrap_err().contains("twice"));
    }
}
