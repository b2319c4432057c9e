//! `sabaki crowd`.

use sabaki::math::Isa;

use super::run::{folder, sabaki};

#[test]
fn crowd_json_has_its_keys() {
    let folder = folder();
    let args = "crowd CLIPS --count 200 --frames 2 --threads 2 --json";
    let document = sabaki(&folder, args).json(0);
    assert!(document["clips"].as_u64().unwrap() > 0);
    assert!(document["key_bytes"].as_u64().unwrap() > 0);
    assert_eq!(document["error_pixels"], 2.0);
    let levels = document["levels"].as_u64().unwrap() as usize;
    let rows = document["rows"].as_array().unwrap();
    // Without levels and by distance, on all registers and one thread or two; each level.
    assert_eq!(rows.len(), 2 * 2 * Isa::available().count() + levels - 1);
    for row in rows {
        assert_eq!(row["count"], 200);
        assert!(row["ms"].as_f64().unwrap() > 0.0);
        assert!(row["against_plain"].as_f64().unwrap() > 0.0);
        assert!(["portable", "avx2", "avx512"].contains(&row["isa"].as_str().unwrap()));
        let threads = row["threads"].as_u64().unwrap();
        assert!(threads == 1 || threads == 2);
        let joints = row["joints"].as_f64().unwrap();
        let per_joint = row["ns_per_joint"].as_f64().unwrap();
        let ms = row["ms"].as_f64().unwrap();
        assert!((per_joint * joints * 200.0 - ms * 1e6).abs() < 1.0, "{row}");
        match row["lod"].as_str().unwrap() {
            "off" => assert_eq!(joints, 24.0),
            "distance" => assert!((6.0..=24.0).contains(&joints)),
            level => assert_eq!(joints, 24.0 - level.parse::<f64>().unwrap()),
        }
    }
    let told = sabaki(&folder, "crowd --count 50 --frames 1").is(0);
    for word in ["50 characters", "levels", "distance", "ns a joint"] {
        assert!(told.stdout.contains(word), "{word} in\n{}", told.stdout);
    }
}
