//! "Did you mean": the nearest of the names allowed.

/// Names are listed in a message up to this many characters.
const LISTED_CHARACTERS: usize = 160;

/// The candidate nearest to `name`, if any is near: at most a third of its characters changed, or one contained in the other.
/// Ties go to the first.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    let distance = |candidate: &str| {
        let other = candidate.to_lowercase();
        let contained = lower.len().min(other.len()) >= 3 && (other.contains(&lower) || lower.contains(&other));
        let edits = strsim::osa_distance(&lower, &other);
        let allowed = 1 + lower.chars().count().max(other.chars().count()) / 4;
        (edits <= allowed || contained).then_some((edits > allowed, edits))
    };
    let near = candidates.into_iter().filter_map(|candidate| distance(candidate).map(|d| (d, candidate)));
    near.min_by_key(|(d, _)| *d).map(|(_, candidate)| candidate)
}

/// `; did you mean X?` and, when short enough, ` (what: a, b, c)`: the tail of a message about an unknown name. `quote` is put
/// around the suggestion.
pub fn advice(name: &str, what: &str, candidates: &[&str], quote: char) -> String {
    let list = candidates.join(", ");
    let listed = list.chars().count() <= LISTED_CHARACTERS;
    did_you_mean(name, candidates, quote) + &if listed { all_of(what, &list) } else { String::new() }
}

/// The same with the whole list, however long.
pub fn full_advice(name: &str, what: &str, candidates: &[&str], quote: char) -> String {
    did_you_mean(name, candidates, quote) + &all_of(what, &candidates.join(", "))
}

fn did_you_mean(name: &str, candidates: &[&str], quote: char) -> String {
    let near = nearest(name, candidates.iter().copied());
    near.map_or_else(String::new, |near| format!("; did you mean {quote}{near}{quote}?"))
}

fn all_of(what: &str, list: &str) -> String {
    format!(" ({what}: {})", if list.is_empty() { "none" } else { list })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_finds_its_name_and_nonsense_finds_none() {
        let keys = ["duration", "step", "method", "poisson"];
        assert_eq!(nearest("stepp", keys), Some("step"));
        assert_eq!(nearest("Duration", keys), Some("duration"));
        assert_eq!(nearest("poissons_ratio", keys), Some("poisson"));
        assert_eq!(nearest("mehtod", keys), Some("method"));
        assert_eq!(nearest("colour", keys), None);
        assert_eq!(nearest("", keys), None);
    }

    #[test]
    fn long_lists_are_left_out() {
        assert_eq!(advice("stp", "keys here", &["step", "end"], '`'), "; did you mean `step`? (keys here: step, end)");
        let long = ["a_rather_long_name_of_a_key"; 20];
        assert_eq!(advice("zzz", "keys here", &long, '`'), "");
        let full = full_advice("zzz", "there are", &long, '`');
        assert!(full.starts_with(" (there are: a_rather_long") && full.len() > 500, "unless all are asked for");
    }
}
