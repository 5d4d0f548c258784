//! The page: one HTML file with everything in it, which needs no network and no script.

use std::fmt::Write;

use super::figures::{Figure, Section, Sums};
use super::gallery::pictures;
use crate::command_line::command_line;
use crate::study::sweep::store::Rate;
use crate::study::sweep::{Design, Exhibit};
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
        let names = self.sums.names();
        *text += "<div class=\"scroll\"><table>\n<tr><th></th><th>runs</th><th>home</th><th>95 %</th><th>wrong claims</th>";
        for (other, _) in OutcomeCounts::default().others() {
            let _ = write!(text, "<th>{other}</th>");
        }
        *text += "<th>time ratio</th><th>final distance</th></tr>\n";
        for (level, name) in names.iter().enumerate() {
            let rows = self.sums.rows.iter();
            let scale = self.sums.compared.as_ref();
            let rows = rows.filter(|row| scale.is_none_or(|scale| scale.level(self.sums.study, row) == Some(level)));
            let t = Tally::of(rows.map(|row| &row.run));
            let [low, high] = t.home_share_95;
            let _ = write!(
                text,
                "<tr><td>{}</td><td>{}</td><td>{:.1} %</td><td>{:.1}\u{2013}{:.1}</td><td>{}</td>",
                escaped(if name.is_empty() { "all" } else { name }),
                t.runs,
                100.0 * t.home_share,
                100.0 * low,
                100.0 * high,
                t.wrong_claims
            );
            for (_, other) in t.outcomes.others() {
                let _ = write!(text, "<td>{other}</td>");
            }
            let number = |v: Option<f64>, scale: f64, unit: &str| {
                v.map_or_else(|| "\u{2013}".to_owned(), |v| format!("{:.2}{unit}", scale * v))
            };
            let (ratio, last) = (number(t.time_ratio.median, 1.0, ""), number(t.final_distance_m.median, 100.0, " cm"));
            let _ = writeln!(text, "<td>{ratio}</td><td>{last}</td></tr>");
        }
        *text += "</table></div>\n<p class=\"faint\">Time ratio is time over straight-line time, the median of the runs that came \
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
        *text += "<div class=\"scroll\"><table>\n<tr><th>pair</th><th>pairs</th><th>both home</th><th>only the first</th>\
                  <th>only the second</th><th>neither</th><th>difference</th><th>95 %</th><th>P</th>\
                  <th>difference of time ratios</th><th>95 %</th></tr>\n";
        let names = self.sums.names();
        for duel in &self.sums.duels {
            let [a, b] = duel.levels.map(|level| escaped(&names[level]));
            let all = duel.all;
            let _ = write!(
                text,
                "<tr><td>{a} \u{2212} {b}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                all.trials(),
                all.both,
                all.only_first,
                all.only_second,
                all.neither
            );
            let signed = |value: f64, decimals: usize| format!("{value:+.decimals$}").replace('-', "\u{2212}");
            let (difference, [low, high]) = duel.success.unwrap_or((0.0, [-1.0, 1.0]));
            let _ = write!(
                text,
                "<td>{} %</td><td>{} to {}</td><td>{}</td>",
                signed(100.0 * difference, 1),
                signed(100.0 * low, 1),
                signed(100.0 * high, 1),
                if all.mid_p() < 0.001 { "&lt; 0.001".to_owned() } else { format!("{:.3}", all.mid_p()) }
            );
            match duel.time_ratio {
                Some((mean, [low, high])) => {
                    let _ =
                        writeln!(text, "<td>{}</td><td>{} to {}</td></tr>", signed(mean, 2), signed(low, 2), signed(high, 2));
                }
                None => *text += "<td>\u{2013}</td><td>\u{2013}</td></tr>\n",
            }
        }
        *text += "</table></div>\n";
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
            *text +=
                "<div class=\"scroll\"><table class=\"words\">\n<tr><th>episodes without a result</th><th>reason</th></tr>\n";
            for (reason, count) in broken.iter().take(20) {
                let _ = writeln!(text, "<tr><td>{count}</td><td>{}</td></tr>", escaped(reason));
            }
            *text += "</table></div>\n";
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
        *text += "<h2>Settings and versions</h2>\n<div class=\"scroll\"><table class=\"words\">\n";
        for (name, value) in rows {
            let _ = writeln!(text, "<tr><td>{name}</td><td>{value}</td></tr>");
        }
        let _ = write!(text, "</table></div>\n<div class=\"scroll\"><pre>{}</pre></div>\n", escaped(&study.text));
    }
}

/// What a million episodes take at a rate, in hours of one core.
pub(super) fn core_hours_per_million(rate: &Rate) -> f64 {
    1e6 * rate.threads as f64 / rate.episodes_per_minute.max(1e-9) / 60.0
}

/// Text as HTML has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
