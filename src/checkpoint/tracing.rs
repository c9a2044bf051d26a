//! How a film was traced, for people: [`Origin::tracing`](super::Origin::tracing) is what the compiler prints of the settings.

/// How a film was traced: "max depth 1000, filter gaussian, crop 8,0,32,16". Settings that ask for nothing, and the picture's size, are
/// left out.
pub fn tracing_in_words(tracing: &str) -> String {
    let asks =
        |&(name, value): &(&str, &str)| !["width", "height"].contains(&name) && value != "None" && value != "false";
    joined(fields(tracing).filter(asks))
}

/// The settings of a film that are others in another one, those that ask for nothing too.
pub(super) fn only_in(tracing: &str, other: &str) -> String {
    let is_new = |field: &(&str, &str)| !fields(other).any(|other| other == *field);
    joined(fields(tracing).filter(is_new))
}

fn joined<'t>(fields: impl Iterator<Item = (&'t str, &'t str)>) -> String {
    fields.map(|(name, value)| said(name, value)).collect::<Vec<_>>().join(", ")
}

/// Names and values of the fields of a structure.
fn fields(structure: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut depth = 0;
    let at_top = move |letter: char| {
        depth += i32::from("({[".contains(letter)) - i32::from(")}]".contains(letter));
        letter == ',' && depth == 0
    };
    structure.split(at_top).filter_map(|field| field.trim().split_once(": "))
}

/// "no crop", "crop 1,2,3,4" as `--crop` has it, "transparent".
fn said(name: &str, value: &str) -> String {
    let name = name.replace('_', " ");
    let value = value.strip_prefix("Some(").and_then(|value| value.strip_suffix(')')).unwrap_or(value);
    match (value, value.split_once(" { ")) {
        ("None", _) => format!("no {name}"),
        ("false", _) => format!("not {name}"),
        ("true", _) => name,
        (_, Some((_, inner))) => {
            let numbers: Vec<&str> = fields(inner.trim_end_matches(" }")).map(|(_, number)| number).collect();
            format!("{name} {}", numbers.join(","))
        }
        _ => format!("{name} {}", apart(value)),
    }
}

/// "blackman harris" of "BlackmanHarris".
fn apart(text: &str) -> String {
    let mut apart = String::new();
    for letter in text.chars() {
        if letter.is_uppercase() && apart.ends_with(char::is_lowercase) {
            apart.push(' ');
        }
        apart.extend(letter.to_lowercase());
    }
    apart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracing_is_said_without_what_it_does_not_do() {
        let tracing = "width: 64, max_depth: 1000, filter: BlackmanHarris, clamp: Some(9.0), crop: Some(Crop { x: 1, y: 2, width: 3, height: 4 }), \
                       transparent: true, prune: None";
        let words = "max depth 1000, filter blackman harris, clamp 9.0, crop 1,2,3,4, transparent";
        assert_eq!(tracing_in_words(tracing), words);
    }

    /// Parts of a crop are no settings of their own.
    #[test]
    fn a_crop_is_named_as_a_whole() {
        let whole =
            "width: 32, height: 32, crop: None, transparent: false, prune: Some(Pruning { nits_per_unit: 100.0 })";
        let part = "width: 32, height: 32, crop: Some(Crop { x: 0, y: 0, width: 32, height: 32 }), transparent: true, prune: None";
        assert_eq!(only_in(whole, part), "no crop, not transparent, prune 100.0");
        assert_eq!(only_in(part, whole), "crop 0,0,32,32, transparent, no prune");
        let other = part.replace("y: 0", "y: 4");
        assert_eq!([only_in(part, &other), only_in(&other, part)], ["crop 0,0,32,32", "crop 0,4,32,32"]);
    }
}
