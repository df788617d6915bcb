//! Whether the page can say in its own words what the server has figures for.

use std::collections::BTreeMap;

use lodestep_engine::figures::Figures;

/// What every system has in common, in each language.
const LANGUAGES: [(&str, &str); 2] = [
    ("en", include_str!("../../static/messages/en.json")),
    ("zh-CN", include_str!("../../static/messages/zh-CN.json")),
];

/// What a system or a screen alone says, in the same languages.
const OWN: [(&str, [&str; 2]); 13] = [
    (
        "admin",
        [
            include_str!("../../static/messages/admin.en.json"),
            include_str!("../../static/messages/admin.zh-CN.json"),
        ],
    ),
    (
        "help",
        [
            include_str!("../../static/messages/help.en.json"),
            include_str!("../../static/messages/help.zh-CN.json"),
        ],
    ),
    (
        "lab",
        [
            include_str!("../../static/messages/lab.en.json"),
            include_str!("../../static/messages/lab.zh-CN.json"),
        ],
    ),
    (
        "markers",
        [
            include_str!("../../static/messages/markers.en.json"),
            include_str!("../../static/messages/markers.zh-CN.json"),
        ],
    ),
    (
        "past",
        [
            include_str!("../../static/messages/past.en.json"),
            include_str!("../../static/messages/past.zh-CN.json"),
        ],
    ),
    (
        "pedestrian",
        [
            include_str!("../../static/messages/pedestrian.en.json"),
            include_str!("../../static/messages/pedestrian.zh-CN.json"),
        ],
    ),
    (
        "pole",
        [
            include_str!("../../static/messages/pole.en.json"),
            include_str!("../../static/messages/pole.zh-CN.json"),
        ],
    ),
    (
        "cabin",
        [
            include_str!("../../static/messages/cabin.en.json"),
            include_str!("../../static/messages/cabin.zh-CN.json"),
        ],
    ),
    (
        "reference",
        [
            include_str!("../../static/messages/reference.en.json"),
            include_str!("../../static/messages/reference.zh-CN.json"),
        ],
    ),
    (
        "rover",
        [
            include_str!("../../static/messages/rover.en.json"),
            include_str!("../../static/messages/rover.zh-CN.json"),
        ],
    ),
    (
        "sessions",
        [
            include_str!("../../static/messages/sessions.en.json"),
            include_str!("../../static/messages/sessions.zh-CN.json"),
        ],
    ),
    (
        "tokens",
        [
            include_str!("../../static/messages/tokens.en.json"),
            include_str!("../../static/messages/tokens.zh-CN.json"),
        ],
    ),
    (
        "upload",
        [
            include_str!("../../static/messages/upload.en.json"),
            include_str!("../../static/messages/upload.zh-CN.json"),
        ],
    ),
];

/// Holds that each language has a sentence for this, the system's own or a general one, and that it names every figure there is
/// and no other. What has no figures is told by the general sentence of its kind, and needs none of its own.
pub(crate) fn assert_words(system: &str, start: &str, code: &str, figures: &Figures) {
    let named: Vec<&str> = figures.keys().map(String::as_str).collect();
    if named.is_empty() && start.ends_with(".told") {
        return;
    }
    let key = [&[start, code][..], &named[..]].concat().join(".");
    let own = OWN.iter().find(|(name, _)| *name == system);
    for (number, (language, general)) in LANGUAGES.into_iter().enumerate() {
        let messages = |text: &str| serde_json::from_str::<BTreeMap<String, String>>(text).unwrap();
        // A system's own sentence stands for the general one.
        let own = own.and_then(|(name, texts)| messages(texts[number]).remove(&format!("{name}.{key}")));
        let sentence = own
            .or_else(|| messages(general).remove(&key))
            .or_else(|| OWN.iter().find_map(|(_, texts)| messages(texts[number]).remove(&key)))
            .unwrap_or_else(|| panic!("static/messages/{language}.json has no {key:?}"));
        let mut places: Vec<&str> = sentence
            .split('{')
            .skip(1)
            .filter_map(|rest| rest.split_once('}'))
            .map(|(name, _)| name)
            .collect();
        places.sort_unstable();
        places.dedup();
        assert_eq!(places, named, "{language}: {key}: {sentence}");
    }
}
