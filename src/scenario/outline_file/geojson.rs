//! GeoJSON (RFC 7946): one polygon, alone or among features; coordinates are plain planar numbers. Lines with the property `name` name
//! the sides that they run along.

use super::super::read;
use super::{Found, FoundRing};
use serde_json::Value;

/// The polygon and the lines of a GeoJSON text.
pub(super) fn read(text: &str) -> Result<Found, String> {
    let document = read::parse(text).map_err(|error| error.to_string())?;
    let mut found = Found::default();
    add(&document, None, "", &mut found)?;
    Ok(found)
}

fn add(value: &Value, name: Option<&str>, place: &str, found: &mut Found) -> Result<(), String> {
    let word = |key: &str| value.get(key).and_then(Value::as_str);
    let list = |key: &str| {
        let list = value.get(key).and_then(Value::as_array);
        list.ok_or_else(|| wrong(place, &format!("no list `{key}`")))
    };
    match word("type") {
        Some("FeatureCollection") => {
            let mut features = list("features")?.iter().enumerate();
            features.try_for_each(|(i, feature)| add(feature, None, &format!("{place}/features/{i}"), found))
        }
        Some("Feature") => {
            let name = value.pointer("/properties/name").and_then(Value::as_str);
            add(value.get("geometry").unwrap_or(&Value::Null), name, &format!("{place}/geometry"), found)
        }
        Some("Polygon") => add_polygon(list("coordinates")?, &format!("{place}/coordinates"), found),
        Some("MultiPolygon") => match list("coordinates")?.as_slice() {
            [Value::Array(rings)] => add_polygon(rings, &format!("{place}/coordinates/0"), found),
            several => Err(wrong(place, &format!("{} polygons where one belongs", several.len()))),
        },
        Some("LineString") => {
            let nameless = "a line needs the property `name`, which is what the sides along it are called";
            let name = name.ok_or_else(|| wrong(place, nameless))?;
            let points = points(list("coordinates")?, &format!("{place}/coordinates"))?;
            found.lines.push((name.to_owned(), points));
            Ok(())
        }
        Some(other) => {
            Err(wrong(place, &format!("\"{other}\" is not taken (Polygon and LineString, alone or as features)")))
        }
        None => Err(wrong(place, "no `type`; is this GeoJSON?")),
    }
}

/// A message with its place in the file, as a JSON pointer.
fn wrong(place: &str, message: &str) -> String {
    if place.is_empty() { message.to_owned() } else { format!("{place}: {message}") }
}

fn add_polygon(rings: &[Value], place: &str, found: &mut Found) -> Result<(), String> {
    if !found.rings.is_empty() {
        return Err(format!("{place}: a second polygon; an outline is one, with holes"));
    }
    for (i, ring) in rings.iter().enumerate() {
        let place = format!("{place}/{i}");
        let entries = ring.as_array().ok_or_else(|| format!("{place}: not a list of points"))?;
        let ring = FoundRing { points: points(entries, &place)?, names: Vec::new() };
        if found.rings.first().is_some_and(|border| ring.area() > border.area()) {
            return Err(format!("{place}: a hole with a larger area than the polygon's border, which comes first"));
        }
        found.rings.push(ring);
    }
    Ok(())
}

fn points(entries: &[Value], place: &str) -> Result<Vec<[f64; 2]>, String> {
    let point = |(i, entry): (usize, &Value)| {
        let coordinate = |k: usize| entry.get(k).and_then(Value::as_f64);
        let point = coordinate(0).zip(coordinate(1)).map(|(x, y)| [x, y]);
        point.ok_or_else(|| format!("{place}/{i}: {entry} is not a point [x, y]"))
    };
    entries.iter().enumerate().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_give_a_polygon_with_a_hole_and_named_lines() {
        let text = r#"{"type": "FeatureCollection", "features": [
            {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates":
                [[[0, 0], [9, 0], [9, 9], [0, 0]], [[5, 1], [6, 1], [6, 2], [5, 1]]]}},
            {"type": "Feature", "properties": {"name": "base"}, "geometry": {"type": "LineString", "coordinates": [[0, 0], [9, 0, 7]]}}]}"#;
        let found = read(text).unwrap();
        assert_eq!(found.rings.iter().map(|ring| ring.points.len()).collect::<Vec<_>>(), [4, 4]);
        assert_eq!(found.lines, [("base".to_owned(), vec![[0.0, 0.0], [9.0, 0.0]])]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let cases = [
            ("{", "line 1"),
            (r#"{"a": 1}"#, "is this GeoJSON?"),
            (r#"{"type": "Point"}"#, "\"Point\" is not taken"),
            (r#"{"type": "Polygon", "coordinates": [[[0, "x"]]]}"#, "/coordinates/0/0: [0,\"x\"] is not a point"),
            (
                r#"{"type": "Polygon", "coordinates": [[[1, 1], [2, 1], [2, 2]], [[0, 0], [9, 0], [9, 9]]]}"#,
                "/coordinates/1: a hole with a larger area",
            ),
            (r#"{"type": "LineString", "coordinates": []}"#, "needs the property `name`"),
            (r#"{"type": "MultiPolygon", "coordinates": [[], []]}"#, "2 polygons where one belongs"),
            (r#"{"type": "FeatureCollection"}"#, "no list `features`"),
        ];
        for (text, words) in cases {
            let message = read(text).unwrap_err();
            assert!(message.contains(words), "{message}");
        }
    }
}
