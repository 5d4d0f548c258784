//! The audit: a row for each claim of the paper, and each departure of this program from its text. `audit.md` has the words.

use super::contest::{Order, range, untold_home};
use super::tables::{below, start_error_name, tally_cells};
use super::{Section, Target, short};
use crate::control::Law;
use crate::draw::chart::{Axis, Chart, Mark, Stroke};
use crate::draw::markdown::table_of_numbers;
use crate::error::Result;
use crate::method::MethodKind;
use crate::study::paper::claims::{Both, Claims, Tally, tally};
use crate::study::paper::contest::{Contest, Told};
use crate::study::paper::course::{Run, StartError};
use crate::study::paper::evidence::Evidence;
use crate::study::paper::images::ImageSet;
use crate::study::paper::{TABLE_I, TABLE_II};

/// The section.
///
/// # Errors
/// When a part of the evidence cannot be had.
pub(super) fn audit(evidence: &Evidence) -> Result<Section> {
    let [own, vardy] = [evidence.set(ImageSet::Paper)?, evidence.set(ImageSet::Vardy)?];
    let (claims, ideal, images) = (evidence.claims()?, evidence.table_one()?, own.runs()?);
    let (own_claims, vardy_claims) = (own.claims()?, vardy.claims()?);
    let [own_contest, vardy_contest] = [&own.contests()?[0], &vardy.contests()?[0]];
    let [own_order, vardy_order] = [own_contest, vardy_contest].map(Order::of);
    let [truth, far, turned, place, untold] =
        [StartError::None, StartError::Range(1.2), StartError::HALF_RIGHT_ANGLE, StartError::Place(0.5), StartError::Untold]
            .map(|start| claims.started(start).map_or_else(Default::default, |both| both.each_ref().map(home)));
    let [noise_low, noise_high, noise_stated] = &claims.noise;
    let [proportional, _] = tally(ideal);
    let text = format!(
        include_str!("audit.md"),
        from_truth = truth[0],
        from_truth_printed = truth[1],
        from_range = far[0],
        from_range_printed = far[1],
        from_heading = turned[0],
        from_heading_printed = turned[1],
        from_place = place[0],
        from_nothing = untold[0],
        anchored = home(&claims.anchored),
        below_one = below(ideal, &TABLE_I),
        ideal_r = greatest(ideal, 0),
        ideal_theta = greatest(ideal, 1),
        ideal_alpha = greatest(ideal, 2),
        images_alpha = greatest(images, 2),
        ode45 = range_rmse(&claims.ode45),
        euler = range_rmse(&claims.euler),
        printed_alpha = own_claims.printed.map(|t| short(t.heading_rmse_rad)).join(" and "),
        frozen = claims.frozen,
        below_two = below(images, &TABLE_II),
        blind = range_rmse(&own_claims.blind),
        images_untold = home(&own_claims.untold),
        look_own = own_claims.one_look_cm,
        look_vardy = vardy_claims.one_look_cm,
        less_own = range(own_order.percent.map(|p| p.map(percent_of_theirs))),
        less_vardy = range(vardy_order.percent.map(|p| p.map(percent_of_theirs))),
        beaten_own = own_order.beaten(),
        beaten_vardy = vardy_order.beaten(),
        across_own = own_order.across,
        across_vardy = vardy_order.across,
        compasses = own_order.compasses,
        anchored_ratio = mean_ratio(own_contest, &MethodKind::AnchoredEkf, Told::Nothing),
        paper_ratio = mean_ratio(own_contest, &MethodKind::PaperEkf, Told::Start),
        told_own = untold_home(own_contest, &MethodKind::PaperEkf),
        told_vardy = untold_home(vardy_contest, &MethodKind::PaperEkf),
        anchored_own = untold_home(own_contest, &MethodKind::AnchoredEkf),
        anchored_vardy = untold_home(vardy_contest, &MethodKind::AnchoredEkf),
        degenerate = 100.0 * evidence.homeward()?.degenerate_share(),
        noise_low = range_rmse(noise_low),
        noise_high = range_rmse(noise_high),
        noise_stated = noise_stated.map(|t| t.home.to_string()).join(" and "),
        proportional = proportional.home,
        proportional_ratio = proportional.ratio.unwrap_or(f64::NAN),
        beta_slow = betas(claims, 0.1),
        beta_fast = betas(claims, 0.01),
        starts = starts_table(claims),
    );
    Ok(Section::new(Target::Audit, text, [beta_svg(claims).into_bytes()]))
}

/// Both laws in words: "4 and 4 of 4 home".
fn home(both: &Both) -> String {
    format!("{} and {} of 4 home", both[0].home, both[1].home)
}

/// Both laws' errors of R, cm.
fn range_rmse(both: &Both) -> String {
    both.map(|t| short(t.range_rmse_cm)).join(" and ")
}

/// Greatest of an error over runs: of R (0), theta (1), alpha (2).
fn greatest(runs: &[Run], state: usize) -> String {
    short(runs.iter().filter_map(|r| Some(r.track.rmse()?[state])).fold(0.0, f64::max))
}

/// Time over straight-line time under the proportional law.
fn mean_ratio(contest: &Contest, method: &MethodKind, told: Told) -> String {
    let row = contest.row(method, Law::Proportional, told);
    row.and_then(|row| row.mean_ratio).map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.3}"))
}

/// By how much ours is less, as a share of theirs, when theirs exceeds ours by `percent`.
fn percent_of_theirs(percent: f64) -> f64 {
    100.0 * percent / (100.0 + percent)
}

/// Beta and what came of it at one sampling period, in the order of the experiments.
fn at_period(claims: &Claims, period_s: f64) -> impl Iterator<Item = (f64, &Tally)> {
    claims.beta.iter().filter(move |(_, period, _)| *period == period_s).map(|(beta, _, tally)| (*beta, tally))
}

fn betas(claims: &Claims, period_s: f64) -> String {
    let words = at_period(claims, period_s).map(|(beta, tally)| {
        let ratio = tally.ratio.map_or("-".to_owned(), |r| format!("{r:.2}"));
        format!("beta {beta}: {} of 4, {ratio}", tally.home)
    });
    words.collect::<Vec<_>>().join("; ")
}

fn starts_table(claims: &Claims) -> String {
    let row = |name: String, cells: &[[String; 3]; 2]| [&[name], cells.as_flattened()].concat();
    let started = |(start, both): &(StartError, [Both; 2])| row(start_error_name(*start), &both.each_ref().map(tally_cells));
    let anchored = row("anchored filter, told nothing".into(), &[tally_cells(&claims.anchored), Default::default()]);
    table_of_numbers(
        "started at | home of 4 | R rmse (cm) | alpha rmse (rad) | with G as printed: home of 4 | R rmse (cm) | alpha rmse (rad)",
        1,
        claims.starts.iter().map(started).chain([anchored]),
    )
}

fn beta_svg(claims: &Claims) -> String {
    let y = Axis::linear("time / straight-line time, mean of P1 to P4");
    let mut chart = Chart::new("Time home under (16), filter started at the truth", Axis::log("beta"), y);
    for (k, period_s) in [0.1, 0.01].into_iter().enumerate() {
        let ratio = |tally: &Tally| tally.ratio.filter(|_| tally.home == 4).unwrap_or(f64::NAN);
        let points: Vec<[f64; 2]> = at_period(claims, period_s).map(|(beta, tally)| [beta, ratio(tally)]).collect();
        let line = chart.line(points.clone(), &Stroke::series(k), &format!("Ts = {period_s} s"));
        chart = line.points(points, &Mark::series(k), "");
    }
    chart.note("a point where all four come home").to_svg()
}
