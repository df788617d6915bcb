//! A rover that never was: its truth first, then the observations of rover and base, the orbits and the ranges, as files.
//!
//! A whole world is drawn from a seed: site, sky, way, radios, clocks. Nothing here knows the estimator, nor its orbits.

mod clock;
mod orbit;
mod receiver;
mod rinex;
mod tag;
mod world;

use std::fmt::Write as _;

use crate::geo::{Geodetic, LocalFrame};
use crate::sim::random::{Purpose, Random};
use clock::Instant;
use orbit::{Satellite, System};
use receiver::{Observed, Quality, Receiver};
use world::{Place, World};

/// What the rover does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// Into a hall and out again; satellites vanish one after the other.
    Doorway,
    /// In a hall: ranges only.
    Hall,
    /// Standing under trees.
    Canopy,
    /// A walk under the open sky.
    Open,
}

impl Scene {
    /// All scenes, with the word of each.
    pub const ALL: [(&'static str, Scene); 4] = [
        ("doorway", Scene::Doorway),
        ("hall", Scene::Hall),
        ("canopy", Scene::Canopy),
        ("open", Scene::Open),
    ];
}

/// A file of a made world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MadeFile {
    /// Its name.
    pub name: &'static str,
    /// What is in it.
    pub text: String,
}

/// The files of a world: `rover.obs`, `base.obs`, `base.nav` where there are satellites, `uwb.csv`, `anchors.csv`,
/// where there are anchors, and `rover.toml`, `site.toml`, `truth.csv` and `meta.json`.
pub fn simulate(scene: Scene, seed: u64) -> Vec<MadeFile> {
    let world = World::draw(scene, seed);
    let mut random = Random::new(seed, 0, Purpose::RoverSky);
    let begin = Instant { week: 2_340, tow_s: random.uniform(20_000.0, 560_000.0).floor() };
    let sky: Vec<Satellite> = orbit::draw(&mut random, begin).into_iter().map(Satellite::rounded).collect();
    let mut files = Vec::new();
    let mut file = |name: &'static str, text: String| files.push(MadeFile { name, text });
    let mut counts = Vec::new();
    let mut slips = [0; 2];
    if scene != Scene::Hall {
        let stations = stations(&world, &sky, begin, seed);
        counts = stations.counts;
        slips = stations.slips;
        file("base.obs", rinex::observations("BASE", world.base.to_ecef_m(), &sky, &stations.base));
        file("rover.obs", rinex::observations("ROVER", stations.approximate_e, &sky, &stations.rover));
        file("base.nav", rinex::navigation(&sky));
    }
    let (ranges, offset_s) = tag::ranges(&world, begin.tow_s, seed);
    if !world.anchors.is_empty() {
        let mut text = String::from("t_s,anchor,range_m\n");
        for range in &ranges {
            let _ =
                writeln!(text, "{:.4},{},{:.3}", range.t_s, world.anchors[range.anchor].name, range.range_m);
        }
        file("uwb.csv", text);
        let mut text = String::from("anchor,e_m,n_m,u_m\n");
        for anchor in &world.anchors {
            let [e, n, u] = anchor.p_n;
            let _ = writeln!(text, "{},{e:.4},{n:.4},{u:.4}", anchor.name);
        }
        file("anchors.csv", text);
    }
    file("rover.toml", toml(&world));
    file("site.toml", site(&world));
    file("truth.csv", truth(&world, begin, &counts));
    file("meta.json", meta(&world, begin, offset_s, slips));
    files
}

struct Stations {
    base: Vec<(Instant, Vec<Observed>)>,
    rover: Vec<(Instant, Vec<Observed>)>,
    counts: Vec<[usize; 2]>,
    slips: [usize; 2],
    approximate_e: [f64; 3],
}

fn stations(world: &World, sky: &[Satellite], begin: Instant, seed: u64) -> Stations {
    const SLIPS_HZ: f64 = 1.0 / 2_500.0;
    let good = Quality {
        code_m: 0.25,
        phase_m: 0.0015,
        code_multipath_m: 0.3,
        phase_multipath_m: 0.002,
        slips_hz: 0.0,
    };
    let rover_quality = match world.scene {
        Scene::Canopy => {
            Quality { code_multipath_m: 1.0, phase_multipath_m: 0.006, slips_hz: 4.0 * SLIPS_HZ, ..good }
        }
        _ => Quality { slips_hz: SLIPS_HZ, ..good },
    };
    let moves = world.scene != Scene::Canopy;
    let mut base = Receiver::new(good, sky.len(), Random::new(seed, 0, Purpose::RoverReceiver), false);
    let mut rover =
        Receiver::new(rover_quality, sky.len(), Random::new(seed, 1, Purpose::RoverReceiver), moves);
    let mut random = Random::new(seed, 2, Purpose::RoverReceiver);
    let frame = LocalFrame::new(world.base);
    let ranks = ranks(world, sky, begin, &frame, &mut random);
    let mut out = Stations {
        base: Vec::new(),
        rover: Vec::new(),
        counts: Vec::new(),
        slips: [0; 2],
        approximate_e: frame.to_geodetic(world.rover_n(0.0)).to_ecef_m(),
    };
    for second in 0..world.duration_s() as u32 {
        let t_s = f64::from(second);
        let tag = begin.after(t_s);
        let all: Vec<usize> = ranks.concat();
        let at_base = base.observe(sky, tag, t_s, world.base, &all);
        let visible = visible(world, &ranks, t_s, &mut random);
        let place: Geodetic = frame.to_geodetic(world.rover_n(t_s));
        let at_rover = rover.observe(sky, tag, t_s, place, &visible.concat());
        out.counts.push([visible[0].len(), visible[1].len()]);
        out.base.push((tag, at_base));
        out.rover.push((tag, at_rover));
    }
    out.slips = [rover.slips, rover.slips_without_lli];
    out
}

/// The satellites of GPS and of BDS that stand high enough, those first that the building hides last.
fn ranks(
    world: &World,
    sky: &[Satellite],
    begin: Instant,
    frame: &LocalFrame,
    random: &mut Random,
) -> [Vec<usize>; 2] {
    const MASK_DEG: f64 = 12.0;
    [System::Gps, System::Bds].map(|system| {
        let mut up: Vec<(f64, usize)> = sky
            .iter()
            .enumerate()
            .filter(|(_, satellite)| satellite.system == system)
            .filter_map(|(k, satellite)| {
                let (elevation, azimuth) = receiver::direction(satellite, begin, frame);
                if elevation < MASK_DEG.to_radians() {
                    return None;
                }
                // Roof and front hide what stands high and what stands behind them.
                let behind = (azimuth - world.door_azimuth).cos() * elevation.cos();
                Some((behind + 0.5 * elevation.sin() + 0.1 * random.normal(), k))
            })
            .collect();
        up.sort_by(|a, b| a.0.total_cmp(&b.0));
        up.into_iter().map(|(_, k)| k).collect()
    })
}

/// What the rover sees of them: in the doorway ever fewer, down to two of each system; under trees now these, now those.
fn visible(world: &World, ranks: &[Vec<usize>; 2], t_s: f64, random: &mut Random) -> [Vec<usize>; 2] {
    const LEAST: usize = 2;
    ranks.clone().map(|of_system| match world.place(t_s) {
        Place::Outdoor => of_system,
        Place::Indoor => Vec::new(),
        Place::Doorway => {
            let into = world.in_door(&world.rover_n(t_s))[0];
            // The last quarter of the way has the least.
            let share = ((-into / world.doorway_m - 0.25) / 0.75).clamp(0.0, 1.0);
            let count = LEAST + ((of_system.len().saturating_sub(LEAST)) as f64 * share).floor() as usize;
            of_system.into_iter().take(count).collect()
        }
        Place::Canopy => {
            let most = if of_system.len() > 8 { 7 } else { 5 };
            let kept: Vec<usize> = of_system.into_iter().take(most).collect();
            kept.into_iter().filter(|_| random.uniform(0.0, 1.0) > 0.02).collect()
        }
    })
}

/// The site of the world: its metres count from the base.
fn site(world: &World) -> String {
    format!("name = \"Base\"\n{}", place(world))
}

fn place(world: &World) -> String {
    let Geodetic { latitude_deg, longitude_deg, height_m } = world.base;
    format!("latitude_deg = {latitude_deg}\nlongitude_deg = {longitude_deg}\nheight_m = {height_m}\n")
}

fn toml(world: &World) -> String {
    let [e, n, u] = world.antenna_offset_m;
    let mut text = format!("[site]\n{}", place(world));
    if world.anchors.is_empty() {
        return text;
    }
    let _ = write!(
        text,
        "\n[uwb]\n# UWB antenna minus satellite antenna, east north up, metres\nantenna_offset_m = [{e:.3}, {n:.3}, {u:.3}]\n"
    );
    if world.scene == Scene::Hall {
        let height = world.tag_n(0.0)[2];
        let _ = write!(text, "antenna_height_m = {height:.2}\nantenna_height_sigma_m = 0.05\n");
    }
    for anchor in &world.anchors {
        let [e, n, u] = anchor.p_n;
        let _ = write!(
            text,
            "\n[[anchors]]\nname = \"{}\"\ne_m = {e:.4}\nn_m = {n:.4}\nu_m = {u:.4}\n",
            anchor.name
        );
    }
    text
}

/// `gps_tow_s,e_m,n_m,u_m,place,gps,bds`; with ranges alone `t_s`, by their clock, and the UWB antenna.
fn truth(world: &World, begin: Instant, counts: &[[usize; 2]]) -> String {
    let mut out = String::from("gps_tow_s,e_m,n_m,u_m,place,gps,bds\n");
    for second in 0..world.duration_s() as u32 {
        let t_s = f64::from(second);
        let [e, n, u] = if world.scene == Scene::Hall { world.tag_n(t_s) } else { world.rover_n(t_s) };
        let [gps, bds] = counts.get(second as usize).copied().unwrap_or_default();
        let place = world.place(t_s).word();
        let tow_s = begin.after(t_s).tow_s;
        let _ = writeln!(out, "{tow_s:.3},{e:.4},{n:.4},{u:.4},{place},{gps},{bds}");
    }
    out
}

fn meta(world: &World, begin: Instant, offset_s: f64, slips: [usize; 2]) -> String {
    let biases: Vec<String> = world.anchors.iter().map(|anchor| format!("{:.4}", anchor.bias_m)).collect();
    format!(
        "{{\"base\": [{:.9}, {:.9}, {:.4}], \"week\": {}, \"uwb_clock_offset_s\": {offset_s:.4}, \"uwb_bias_m\": [{}], \
         \"door_azimuth_deg\": {:.3}, \"slips\": {}, \"slips_without_lli\": {}}}\n",
        world.base.latitude_deg,
        world.base.longitude_deg,
        world.base.height_m,
        begin.week,
        biases.join(", "),
        world.door_azimuth.to_degrees(),
        slips[0],
        slips[1],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text<'a>(files: &'a [MadeFile], name: &str) -> &'a str {
        &files.iter().find(|file| file.name == name).unwrap().text
    }

    #[test]
    fn a_seed_gives_the_same_files_and_another_seed_others() {
        for (_, scene) in Scene::ALL {
            let made = simulate(scene, 3);
            assert_eq!(made, simulate(scene, 3));
            assert_ne!(made, simulate(scene, 4));
        }
    }

    #[test]
    fn satellites_vanish_one_after_the_other_and_none_is_left_in_the_hall() {
        for seed in 0..4 {
            let files = simulate(Scene::Doorway, seed);
            let rows: Vec<(String, usize, usize)> = text(&files, "truth.csv")
                .lines()
                .skip(1)
                .map(|line| {
                    let cells: Vec<&str> = line.split(',').collect();
                    (cells[4].to_owned(), cells[5].parse().unwrap(), cells[6].parse().unwrap())
                })
                .collect();
            let least = rows.iter().filter(|row| row.0 == "doorway").map(|row| (row.1, row.2)).min().unwrap();
            assert_eq!(least, (2, 2), "seed {seed}");
            assert!(rows.iter().filter(|row| row.0 == "indoor").all(|row| row.1 + row.2 == 0));
            let outdoor = rows.iter().filter(|row| row.0 == "outdoor");
            let fewest = (outdoor.clone().map(|row| row.1).min(), outdoor.map(|row| row.2).min());
            assert!(fewest.0 >= Some(5) && fewest.1 >= Some(5), "seed {seed}: {fewest:?}");
            assert_eq!(text(&files, "rover.obs").matches("\n>").count(), {
                rows.iter().filter(|row| row.1 + row.2 > 0).count()
            });
        }
    }

    #[test]
    fn a_hall_has_ranges_and_no_satellites() {
        let files = simulate(Scene::Hall, 1);
        assert!(files.iter().all(|file| !file.name.starts_with("rover.obs")));
        assert!(text(&files, "uwb.csv").lines().count() > 500);
        assert_eq!(text(&files, "anchors.csv").lines().count(), 5);
    }
}
