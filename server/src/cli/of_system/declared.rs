//! What a system declares, as text for a terminal.

use std::fmt::Write as _;

use lodestep_engine::parse::{imu_csv, values_csv};
use lodestep_engine::stream::Kind;
use lodestep_engine::system::{Declaration, StreamRule};

use crate::cli::text_columns::push_aligned;

/// Its streams with their columns, its aids and its parameters.
pub(super) fn text(system: &Declaration) -> String {
    let mut out = String::new();
    for rule in system.streams {
        push_stream(rule, &mut out);
    }
    if let Some(instrument) = system.instrument {
        writeln!(out, "Instrument, as TOML: {}\n", instrument.about)
            .expect("writing to a string cannot fail");
        for line in instrument.example.lines() {
            writeln!(out, "  {line}").expect("writing to a string cannot fail");
        }
        out.push('\n');
    }
    out.push_str("Aids:");
    if system.aids.is_empty() {
        out.push_str(" none\n");
    }
    for (number, aid) in system.aids.iter().enumerate() {
        let start = if number == 0 { "\n" } else { "" };
        writeln!(out, "{start}  {}  {}", aid.kind.as_str(), aid.about)
            .expect("writing to a string cannot fail");
    }
    out.push_str("\nParameters for --set, with their defaults:");
    if system.parameters.is_empty() {
        out.push_str(" none\n");
    } else {
        out.push('\n');
        let rows: Vec<Vec<String>> = system
            .parameters
            .iter()
            .map(|parameter| {
                let unit = if parameter.unit == "1" { "" } else { parameter.unit };
                vec![parameter.key.to_owned(), parameter.default_of(system).to_string(), unit.to_owned()]
            })
            .collect();
        push_aligned(&rows, &mut out);
    }
    out.push_str(
        "\nTimes are seconds since the session's start. Positions are metres east, north and up of the site's origin;\n\
         headings run clockwise from true north. Files are plain or packed with gzip or zstd.",
    );
    out
}

fn push_stream(rule: &StreamRule, out: &mut String) {
    let names = match rule.most {
        1 => rule.name.to_owned(),
        most => format!("{0}_1 … {0}_{most}", rule.name),
    };
    let count = match (rule.least, rule.most) {
        (least, most) if least == most => format!("{least}"),
        (least, most) => format!("{least} to {most}"),
    };
    let mut push = |text: String| {
        out.push_str(&text);
        out.push('\n');
    };
    push(format!("Stream {names} ({count}): {}", rule.title));
    match rule.kind {
        Kind::Imu => {
            push(format!("  CSV with the columns {}", imu_csv::COLUMNS[..7].join(",")));
            push(format!(
                "  and, where recorded, {}; or a log in another known format,",
                imu_csv::COLUMNS[7..].join(",")
            ));
            push("  recognised by its content".to_owned());
        }
        Kind::Values => {
            push(format!("  CSV with a header, columns in any order: {}, and", values_csv::TIME));
            for column in rule.columns {
                let needed = if column.required { "" } else { " (may be left out)" };
                push(format!("  {}{needed}: {}", column.name, column.about));
            }
        }
    }
    out.push('\n');
}

#[cfg(test)]
mod tests {
    use lodestep_engine::systems::catalogue;

    use super::*;

    #[test]
    fn every_stream_column_aid_and_parameter_of_a_system_is_named() {
        for system in catalogue::SYSTEMS {
            let text = text(system);
            let streams = system.streams.iter().flat_map(|rule| {
                std::iter::once(rule.name).chain(rule.columns.iter().map(|column| column.name))
            });
            let aids = system.aids.iter().map(|aid| aid.about);
            let parameters = system.parameters.iter().map(|parameter| parameter.key);
            for word in streams.chain(aids).chain(parameters) {
                assert!(text.contains(word), "{} of {}:\n{text}", word, system.name);
            }
        }
    }
}
