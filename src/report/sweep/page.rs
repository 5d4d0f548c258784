//! The page: one HTML file with everything in it, which needs no network and no script.

use std::fmt::Write;

use super::figures::{Figure, Section, Sums};
use super::gallery::pictures;
use crate::command_line::command_line;
use crate::study::sweep::store::Rate;
use crate::study::sweep::{Design, Exhibit, Row};
use crate::study::tally::{OutcomeCounts, Tally};

const STYLE: &str = include_str!("page.css");

/// What the page shows.
pub(super) struct Page<'a> {
    pub sums: &'a Sums<'a>,
    pub figures: &'a [Figure],
    pub exhibits: &'a [Exhibit],
    /// Failures that could not be run again exactly.
    pub withheld: usize,
    pub rates: &'a [Rate],
    pub folder: String,
    pub sha256: String,
}

impl Page<'_> {
    pub fn html(&self) -> String {
        let study = self.sums.study;
        let mut text = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n\
             <style>{STYLE}</style>\n</head>\n<body>\n<main>\n<p class=\"faint\">wayhome stress study</p>\n<h1>{title}</h1>\n\
             <p>{words}</p>\n",
            title = escaped(&study.name),
            words = escaped(&study.description),
        );
        self.numbers(&mut text);
        self.success(&mut text);
        self.section(&mut text, Section::Curves, "Along each axis", &self.curve_words());
        self.pairs(&mut text);
        self.gallery(&mut text);
        self.settings(&mut text);
        text + "</main>\n</body>\n</html>\n"
    }

    fn numbers(&self, text: &mut String) {
        let all = Tally::of(self.sums.rows.iter().map(|row| &row.run));
        let [low, high] = all.home_share_95;
        *text += "<div class=\"numbers\">\n";
        let mut add = |number: String, words: &str| {
            let _ = writeln!(text, "<div><b>{number}</b><span>{words}</span></div>");
        };
        add(all.runs.to_string(), "episodes");
        add(self.sums.study.cells().to_string(), "cells");
        add(self.sums.study.episodes_per_cell().to_string(), "seeds in each");
        let share = format!("{:.1} %", 100.0 * all.home_share);
        add(share, &format!("came home (95 %: {:.1} to {:.1})", 100.0 * low, 100.0 * high));
        add(all.wrong_claims.to_string(), "claimed to be home, outside the arrival radius");
        add((all.outcomes.panic + all.outcomes.error).to_string(), "panics and errors");
        *text += "</div>\n";
    }

    fn success(&self, text: &mut String) {
        let pooled = if self.sums.others.len() > 2 && !self.sums.is_one_at_a_time() || self.sums.is_sampled() {
            " Axes that a figure does not show are pooled, and ranges are cut into classes."
        } else {
            ""
        };
        let below = if self.sums.is_one_at_a_time() { "" } else { ", with their 95 % Wilson interval below" };
        let words =
            format!("Percent of runs that claimed to be home and came to rest within the arrival radius of it{below}.{pooled}");
        self.section(text, Section::Success, "Who comes home", &words);
        let number = |v: Option<f64>, scale: f64, unit: &str| {
            v.map_or_else(|| "\u{2013}".to_owned(), |v| format!("{:.2}{unit}", scale * v))
        };
        let rows = self.sums.names().into_iter().enumerate().map(|(level, name)| {
            let scale = self.sums.compared.as_ref();
            let at = |row: &&Row| scale.is_none_or(|scale| scale.level(self.sums.study, row) == Some(level));
            let t = Tally::of(self.sums.rows.iter().filter(at).map(|row| &row.run));
            let [low, high] = t.home_share_95.map(|share| 100.0 * share);
            let name = if name.is_empty() { "all".to_owned() } else { escaped(&name) };
            let home =
                [format!("{:.1} %", 100.0 * t.home_share), format!("{low:.1}\u{2013}{high:.1}"), t.wrong_claims.to_string()];
            let others = t.outcomes.others().map(|(_, count)| count.to_string());
            let last = [number(t.time_ratio.median, 1.0, ""), number(t.final_distance_m.median, 100.0, " cm")];
            [&[name, t.runs.to_string()], &home[..], &others, &last].concat()
        });
        let others = OutcomeCounts::default().others().map(|(other, _)| other);
        let head = [&["", "runs", "home", "95 %", "wrong claims"], &others[..], &["time ratio", "final distance"]].concat();
        *text += &table("", &head, rows);
        *text += "<p class=\"faint\">Time ratio is time over straight-line time, the median of the runs that came \
                  home; final distance is the median distance from home at the end of all runs.</p>\n";
    }

    fn curve_words(&self) -> String {
        let others = if self.sums.is_one_at_a_time() { "left as they are" } else { "pooled" };
        format!(
            "Success with its 95 % Wilson interval, and time over straight-line time of the runs that came home with its quartiles; \
             all other axes are {others}. Time ratios of runs that come home only from near by look better than they are."
        )
    }

    fn section(&self, text: &mut String, section: Section, title: &str, words: &str) {
        let figures: Vec<&Figure> = self.figures.iter().filter(|figure| figure.section == section).collect();
        // Three stand side by side, but two and two look better than three and one.
        let class = if figures.len() == 4 { "figures pairwise" } else { "figures" };
        let _ = write!(text, "<h2>{title}</h2>\n<p>{words}</p>\n<div class=\"{class}\">\n");
        for figure in figures {
            let _ = writeln!(text, "<figure data-name=\"{}\">{}</figure>", escaped(&figure.name), figure.svg.trim_end());
        }
        *text += "</div>\n";
    }

    fn pairs(&self, text: &mut String) {
        if self.sums.duels.is_empty() {
            return;
        }
        let words = "Runs of one cell and seed that differ in nothing but the compared setting are a pair: the same start, the same \
                     draws of noise. The maps show the difference of success in percentage points, with its 95 % interval by \
                     Newcombe's method 10 for paired shares (1998); a frame marks intervals without 0. In the table the interval \
                     is a bootstrap over seeds (2000 draws of whole seeds, percentiles), because pairs of one seed in many cells \
                     are not independent; P is McNemar's mid-P, which ignores that.";
        self.section(text, Section::Pairs, "Paired differences", words);
        let names = self.sums.names();
        let signed = |value: f64, decimals: usize| format!("{value:+.decimals$}").replace('-', "\u{2212}");
        let between = |[low, high]: [f64; 2], scale: f64, decimals| {
            format!("{} to {}", signed(scale * low, decimals), signed(scale * high, decimals))
        };
        let rows = self.sums.duels.iter().map(|duel| {
            let [a, b] = duel.levels.map(|level| escaped(&names[level]));
            let all = duel.all;
            let counts = [all.trials(), all.both, all.only_first, all.only_second, all.neither].map(|count| count.to_string());
            let (difference, interval) = duel.success.unwrap_or((0.0, [-1.0, 1.0]));
            let p = if all.mid_p() < 0.001 { "&lt; 0.001".to_owned() } else { format!("{:.3}", all.mid_p()) };
            let success = [format!("{} %", signed(100.0 * difference, 1)), between(interval, 100.0, 1), p];
            let ratio = duel.time_ratio.map(|(mean, interval)| [signed(mean, 2), between(interval, 1.0, 2)]);
            let ratio = ratio.unwrap_or_else(|| ["\u{2013}", "\u{2013}"].map(str::to_owned));
            [&[format!("{a} \u{2212} {b}")], &counts[..], &success, &ratio].concat()
        });
        let counts = ["pair", "pairs", "both home", "only the first", "only the second", "neither"];
        let head = [&counts[..], &["difference", "95 %", "P", "difference of time ratios", "95 %"]].concat();
        *text += &table("", &head, rows);
    }

    fn gallery(&self, text: &mut String) {
        let broken = self.sums.broken();
        if self.exhibits.is_empty() && broken.is_empty() && self.withheld == 0 {
            return;
        }
        *text += "<h2>Failures</h2>\n<p>Of each way to fail the runs that failed where most others came home, with the path and the \
                  last panorama. Black is the true path from the start, dotted green what odometry alone would have told, dashed orange the \
                  estimate with 2-sigma ellipses where a method makes one, red home, blue the end. The command runs a row again \
                  exactly.</p>\n<div class=\"figures\">\n";
        for exhibit in self.exhibits {
            let row = &exhibit.row;
            let _ = write!(text, "<figure>{}", pictures(exhibit));
            let again = command_line(["home", "--replay", &format!("{}:{}", self.folder, row.episode)]);
            let _ = writeln!(
                text,
                "<figcaption><b>{}</b>: {}<br>{}<br><code>{}</code></figcaption></figure>",
                row.run.outcome,
                escaped(&row.run.reason),
                escaped(&self.sums.study.place_in_words(row)),
                escaped(&again)
            );
        }
        *text += "</div>\n";
        if self.withheld > 0 {
            let _ = writeln!(
                text,
                "<p>{} failures are not shown: run again here, they did not run as their rows say.</p>",
                self.withheld
            );
        }
        if !broken.is_empty() {
            let rows = broken.iter().take(20).map(|(reason, count)| [count.to_string(), escaped(reason)]);
            *text += &table(" class=\"words\"", &["episodes without a result", "reason"], rows);
        }
    }

    fn settings(&self, text: &mut String) {
        let study = self.sums.study;
        let mut rows: Vec<(&str, String)> = vec![
            ("study", format!("<code>{}</code>", self.sha256)),
            ("world", format!("{}, <code>{}</code>", escaped(&study.world), study.world_sha256)),
            ("version", format!("wayhome {}", crate::VERSION)),
            ("seeds", format!("{} to {}", study.seeds.start(), study.seeds.end())),
            (
                "design",
                match study.design {
                    Design::Grid => "grid".to_owned(),
                    Design::OneAtATime => "one axis at a time".to_owned(),
                    Design::Random => format!("{} random points", study.points),
                    Design::Sobol => format!("{} points of a Sobol sequence, shifted", study.points),
                },
            ),
        ];
        let mut renderers: Vec<&str> = self.sums.rows.iter().filter_map(|row| row.run.renderer.as_deref()).collect();
        renderers.sort_unstable();
        renderers.dedup();
        rows.push(("renderer", if renderers.is_empty() { "none".to_owned() } else { escaped(&renderers.join(", ")) }));
        for rate in self.rates {
            rows.push((
                "rate",
                format!(
                    "{:.1} episodes a minute on {} threads ({} in {:.0} s), {:.0} core hours for a million",
                    rate.episodes_per_minute,
                    rate.threads,
                    rate.episodes,
                    rate.wall_s,
                    core_hours_per_million(rate)
                ),
            ));
        }
        let rows = rows.into_iter().map(|(name, value)| [name.to_owned(), value]);
        *text += "<h2>Settings and versions</h2>\n";
        *text += &table(" class=\"words\"", &[], rows);
        let _ = writeln!(text, "<div class=\"scroll\"><pre>{}</pre></div>", escaped(&study.text));
    }
}

/// A table that scrolls by itself where it is wider than the page; cells are HTML.
fn table(class: &str, head: &[&str], rows: impl Iterator<Item = impl AsRef<[String]>>) -> String {
    let row = |tag: &str, cells: &[String]| {
        let cells = cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>"));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let head = head.iter().map(|&cell| cell.to_owned()).collect::<Vec<_>>();
    let head = if head.is_empty() { String::new() } else { row("th", &head) };
    let rows = rows.map(|cells| row("td", cells.as_ref())).collect::<String>();
    format!("<div class=\"scroll\"><table{class}>\n{head}{rows}</table></div>\n")
}

/// What a million episodes take at a rate, in hours of one core.
pub(super) fn core_hours_per_million(rate: &Rate) -> f64 {
    1e6 * rate.threads as f64 / rate.episodes_per_minute.max(1e-9) / 60.0
}

/// Text as HTML has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
