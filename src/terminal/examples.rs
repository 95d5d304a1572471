//! What stands below the help, and what was typed.

use std::ffi::OsString;

/// What stands below the help.
pub const EXAMPLES: &str = "Examples:
  tropism scenarios/olfactory.json                       the complete model
  tropism scenarios/olfactory.json --without chemotaxis  an ablation
  tropism scenarios/olfactory.json --set /seed=7 --set /populations/olfactory/count=50
  tropism scenarios/olfactory.json --set '/output/swc={}' --quiet   axons as SWC, and nothing said
  tropism scenarios/olfactory.json --seeds 20 --out out/olfactory-20
  tropism scenarios/olfactory.json --checkpoint 10min    a run that may be interrupted …
  tropism resume out/olfactory                           … and goes on from its newest checkpoint
  tropism plan scenarios/olfactory.json                  what it needs, before it runs
  tropism ablate scenarios/olfactory.json --seeds 4      without each mechanism in turn
  tropism chart scenarios/olfactory.json --only cue_field  error against time
  tropism bench scenarios/load.json --axons 1000,10000   growth cones a second
  tropism figure out/olfactory --time 24h,48h,72h --size 180mm
  tropism movie out/olfactory                            out/olfactory/movie.gif
  tropism stability                                      where methods fail, into out/stability
  tropism mechanisms fasciculation                       its equation and its keys
  tropism schema > scene.schema.json                     for editors; a scene says \"$schema\": \"scene.schema.json\"
  tropism new-mechanism galvanotaxis                     a crate with a mechanism of your own
  tropism completions bash > ~/.local/share/bash-completion/completions/tropism
  tropism man > tropism.1                                then: man ./tropism.1";

/// What was typed, as it can be typed again.
pub fn words(arguments: &[OsString]) -> String {
    let quoted = |argument: &OsString| {
        let text = argument.to_string_lossy().into_owned();
        let plain = |sign: char| sign.is_alphanumeric() || "-_./=,:@%+".contains(sign);
        if !text.is_empty() && text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
    };
    let rest = arguments.iter().skip(1).map(quoted);
    ["tropism".to_owned()].into_iter().chain(rest).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_typed_can_be_typed_again() {
        let typed = ["target/release/tropism", "a b.json", "--set", "/cues/x/diffusion=\"30 um^2/s\"", "it's"]
            .map(OsString::from);
        let expected = r#"tropism 'a b.json' --set '/cues/x/diffusion="30 um^2/s"' 'it'\''s'"#;
        assert_eq!(words(&typed), expected);
    }
}
