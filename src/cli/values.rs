//! How a person writes the values of arguments.

use std::ffi::OsStr;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use strum::{EnumMessage, VariantArray};
use wayhome::episode::Start;
use wayhome::geometry::Pose;
use wayhome::method::MethodKind;
use wayhome::method::exec::ExecCommand;

/// What `--help` says of an alternative of the library: its name and the first paragraph of its documentation.
pub fn described<T: EnumMessage>(value: &T) -> PossibleValue
where
    for<'a> &'a T: Into<&'static str>,
{
    let documentation = value.get_documentation().unwrap_or_default();
    let first = documentation.split("\n\n").next().unwrap_or_default().trim();
    PossibleValue::new(value.into()).help(first.trim_end_matches('.').replace('\n', " "))
}

/// The alternative of this name.
pub fn named<T: Copy>(values: &[T], name: &str) -> Option<T>
where
    for<'a> &'a T: Into<&'static str>,
{
    values.iter().find(|value| (*value).into() == name).copied()
}

/// Reads an alternative by its name.
pub fn choice<T: Copy + EnumMessage + VariantArray + Send + Sync + 'static>() -> impl TypedValueParser<Value = T>
where
    for<'a> &'a T: Into<&'static str>,
{
    choice_of(T::VARIANTS.iter().copied())
}

/// Reads one of some alternatives by its name.
pub fn choice_of<T>(values: impl IntoIterator<Item = T>) -> impl TypedValueParser<Value = T>
where
    T: Copy + EnumMessage + Send + Sync + 'static,
    for<'a> &'a T: Into<&'static str>,
{
    let values: Vec<T> = values.into_iter().collect();
    let known = PossibleValuesParser::new(values.iter().map(described));
    known.try_map(move |given| named(&values, &given).ok_or("unknown name"))
}

/// Reads a homing method: one of the project's own, or a program.
#[derive(Clone)]
pub struct MethodParser;

impl TypedValueParser for MethodParser {
    type Value = MethodKind;

    fn parse_ref(&self, command: &clap::Command, arg: Option<&clap::Arg>, value: &OsStr) -> Result<MethodKind, clap::Error> {
        let text = value.to_string_lossy();
        if !text.starts_with("exec:") {
            PossibleValuesParser::new(self.possible_values().into_iter().flatten()).parse_ref(command, arg, value)?;
        }
        text.parse().map_err(|fault| {
            let place = arg.map_or_else(String::new, |arg| format!(" for '{arg}'"));
            let message = format!("invalid value '{text}'{place}: {fault}\n");
            clap::Error::raw(ErrorKind::ValueValidation, message).with_cmd(command)
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let program =
            "A program of your own, such as exec:\"python3 my_method.py\"; the README says what it is told and answers";
        let own = MethodKind::BUILT_IN.into_iter().map(|kind| described(&kind));
        Some(Box::new(own.chain([PossibleValue::new("exec:COMMAND").help(program)])))
    }
}

/// A method where only programs are meant.
pub fn program(text: &str) -> Result<ExecCommand, String> {
    match text.parse() {
        Ok(MethodKind::Exec(command)) => Ok(command),
        Ok(_) => Err("only a program, exec:COMMAND: the project's own methods are chosen by --contenders".to_owned()),
        Err(fault) => Err(fault.to_string()),
    }
}

/// A time that a clock can wait for.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = positive(text)?;
    if seconds > 86_400.0 {
        return Err("must not be more than a day, 86400 s".to_owned());
    }
    Ok(Duration::from_secs_f64(seconds))
}

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| format!("`{text}` is not a finite number"))
}

pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("must be greater than 0".into()) })
}

pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if v >= 0.0 { Ok(v) } else { Err("must not be negative".into()) })
}

pub fn share(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if (0.0..=1.0).contains(&v) { Ok(v) } else { Err("must be between 0 and 1".into()) })
}

/// Finite numbers between commas, `N` of them; `what` says what they are.
fn numbers<const N: usize>(text: &str, what: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    numbers.try_into().map_err(|found: Vec<_>| format!("found {} numbers, {what}", found.len()))
}

/// `x,y,heading_deg`.
pub fn pose(text: &str) -> Result<Pose, String> {
    let [x, y, heading_deg] = numbers(text, "a pose is three: x,y,heading_deg")?;
    Ok(Pose::new(x, y, heading_deg.to_radians()))
}

/// `X,Y`.
pub fn point(text: &str) -> Result<[f64; 2], String> {
    numbers(text, "a point is two: X,Y")
}

/// `random`, a name, or a pose.
pub fn start(text: &str) -> Result<Start, String> {
    match text {
        "random" => Ok(Start::Random),
        _ if text.contains(',') => pose(text).map(Start::At),
        _ => Ok(Start::Named(text.to_owned())),
    }
}

/// Two values on either side of `separator`.
pub fn pair<T: FromStr>(text: &str, separator: &str) -> Option<(T, T)> {
    let (first, second) = text.split_once(separator)?;
    Some((first.trim().parse().ok()?, second.trim().parse().ok()?))
}

/// `WxH` in pixels.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = pair(text, "x").ok_or("a size is WxH, such as 1440x180")?;
    if !(16..=16384).contains(&width) || !(8..=4096).contains(&height) {
        return Err("allowed are widths of 16 to 16384 and heights of 8 to 4096".into());
    }
    Ok((width, height))
}

/// Most seeds of one batch.
const MOST_SEEDS: u64 = 100_000;

/// `A..B`, both ends included.
pub fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let ends = pair(&text.replacen("..=", "..", 1), "..");
    let (first, last): (u64, u64) = ends.ok_or("seeds are A..B, such as 1..40, both ends included")?;
    if first > last || last - first >= MOST_SEEDS {
        return Err(format!("allowed are 1 to {MOST_SEEDS} seeds, the first one not above the last"));
    }
    Ok(first..=last)
}

/// How many seeds there are.
pub fn count(seeds: &RangeInclusive<u64>) -> u64 {
    seeds.end() - seeds.start() + 1
}

/// Seeds as [`seeds`] reads them.
pub fn range(seeds: &RangeInclusive<u64>) -> String {
    format!("{}..{}", seeds.start(), seeds.end())
}

/// `i/n`, from `1/n` to `n/n`.
pub fn shard(text: &str) -> Result<[u64; 2], String> {
    let (i, n): (u64, u64) = pair(text, "/").ok_or("a shard is i/n, such as 2/8")?;
    if i == 0 || i > n {
        return Err(format!("allowed are shards 1/{n} to {n}/{n}", n = n.max(1)));
    }
    Ok([i, n])
}

/// `DIR:ROW`.
pub fn row(text: &str) -> Result<(PathBuf, u64), String> {
    let parts = text.rsplit_once(':').and_then(|(folder, row)| Some((folder, row.parse().ok()?)));
    let (folder, row) =
        parts.filter(|(folder, _)| !folder.is_empty()).ok_or("a row is DIR:ROW, such as results/runs/sweep:17")?;
    Ok((PathBuf::from(folder), row))
}

/// A path whose ending is that of a kind of file.
pub fn ending(allowed: &'static str) -> impl Fn(&str) -> Result<PathBuf, String> + Clone {
    move |text| {
        let path = PathBuf::from(text);
        match path.extension().map(|found| found.to_string_lossy().to_lowercase()) {
            Some(found) if found == allowed => Ok(path),
            Some(found) => Err(format!("found the ending .{found}, allowed is .{allowed}")),
            None => Err(format!("found no ending, allowed is .{allowed}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wayhome::control::Law;
    use wayhome::episode::{PlantKind, SensorKind};
    use wayhome::panorama_set::LayoutKind;
    use wayhome::report::paper::Target;
    use wayhome::study::robustness::Axis;
    use wayhome::vision::Landmarks;
    use wayhome::world::{CameraPreset, LightPreset};

    #[test]
    fn alternatives_are_called_what_files_call_them_and_explained() {
        fn check<T: VariantArray + EnumMessage + serde::Serialize + 'static>()
        where
            for<'a> &'a T: Into<&'static str>,
        {
            for value in T::VARIANTS {
                let shown = described(value);
                assert_eq!(serde_json::to_value(value).unwrap(), shown.get_name());
                assert!(!shown.get_help().unwrap().to_string().is_empty(), "{}", shown.get_name());
            }
        }
        check::<PlantKind>();
        check::<SensorKind>();
        check::<Law>();
        check::<Landmarks>();
        check::<LightPreset>();
        check::<CameraPreset>();
        check::<LayoutKind>();
        check::<Axis>();
        check::<Target>();
        check::<wayhome::verify::vision::condition::Factor>();
    }

    #[test]
    fn methods_are_read_by_name() {
        let command = clap::Command::new("test");
        let read = |text: &str| MethodParser.parse_ref(&command, None, OsStr::new(text));
        assert_eq!(read("alv").unwrap(), MethodKind::Alv);
        assert_eq!(read("exec:python3 'a b.py'").unwrap().to_string(), "exec:python3 'a b.py'");
        for bad in ["", "alvv", "exec:", "exec: 'open", "exec"] {
            assert!(read(bad).is_err(), "{bad}");
        }
        assert!(program("alv").is_err() && program("exec:a").is_ok());
        assert!(seconds("0").is_err() && seconds("1e30").is_err() && seconds("0.5").is_ok());
    }

    #[test]
    fn values_are_read_and_checked() {
        assert_eq!(size("1440x180"), Ok((1440, 180)));
        for bad in ["0x0", "15x180", "1440x4097", "1440", "1440x", "-1x5", "99999999999x8", "1440X180"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(pose("1, -2,180"), Ok(Pose::new(1.0, -2.0, std::f64::consts::PI)));
        for bad in ["", "1,2", "1,2,3,4", "1,2,x", "NaN,0,0", "inf,0,0", "1e999,0,0"] {
            assert!(pose(bad).is_err(), "{bad}");
        }
        assert_eq!(seeds("1..40"), Ok(1..=40));
        assert_eq!(seeds("7..=7"), Ok(7..=7));
        for bad in ["", "1", "2..1", "..", "0..100000", "-1..3", "0..18446744073709551615", "1..==2"] {
            assert!(seeds(bad).is_err(), "{bad}");
        }
        assert_eq!(start("P1"), Ok(Start::Named("P1".into())));
        assert!(start("1,2").is_err());
        assert!(positive("0").is_err() && not_negative("-1").is_err() && share("1.1").is_err());
        assert_eq!(shard("2/8"), Ok([2, 8]));
        for bad in ["0/8", "9/8", "8", "1/0", "a/b", "-1/2", "1/2/3"] {
            assert!(shard(bad).is_err(), "{bad}");
        }
        assert!(shard("9/8").unwrap_err().contains("1/8 to 8/8"));
        assert_eq!(row("a:b/c:17"), Ok(("a:b/c".into(), 17)));
        assert!(row("17").is_err() && row(":17").is_err() && row("a:b").is_err());
    }
}
