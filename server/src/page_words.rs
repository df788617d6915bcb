//! Whether the page can say in its own words what the server has figures for.

use std::collections::BTreeMap;

use lodestep_engine::figures::Figures;

/// What every system has in common, and what the pedestrian alone says, in each language.
const LANGUAGES: [(&str, &str, &str); 2] = [
    (
        "en",
        include_str!("../../static/messages/en.json"),
        include_str!("../../static/messages/pedestrian.en.json"),
    ),
    (
        "zh-CN",
        include_str!("../../static/messages/zh-CN.json"),
        include_str!("../../static/messages/pedestrian.zh-CN.json"),
    ),
];

/// Holds that each language has a sentence for this, and that it names every figure there is and no other. What has no
/// figures is told by the general sentence of its kind, and needs none of its own.
pub(crate) fn assert_words(start: &str, code: &str, figures: &Figures) {
    let named: Vec<&str> = figures.keys().map(String::as_str).collect();
    if named.is_empty() && start.ends_with(".told") {
        return;
    }
    let key = [&[start, code][..], &named[..]].concat().join(".");
    for (language, general, own) in LANGUAGES {
        let messages = |text: &str| serde_json::from_str::<BTreeMap<String, String>>(text).unwrap();
        // A system's own sentence stands for the general one.
        let own = messages(own).remove(&format!("pedestrian.{key}"));
        let sentence = own
            .or_else(|| messages(general).remove(&key))
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
