//! Tests of warnings about values that are ignored or changed.

use super::super::LIGHT_SAMPLES;
use super::*;
use crate::note::Note;

fn notes(text: &str) -> Vec<String> {
    parse(text).unwrap().notes.iter().map(Note::to_string).collect()
}

#[test]
fn keys_that_the_path_tracer_ignores_cause_notes() {
    for (added, expected) in [
        (
            "ambient = [0, 0.1, 0]",
            "render.ambient: no effect with integrator = \"path\", which computes indirect light",
        ),
        (
            "shadows = 'transparent'",
            "render.shadows: no effect with integrator = \"path\", which traces light through glass",
        ),
        ("light_samples = { count = 4 }", LIGHT_SAMPLES),
        ("light_samples = { pattern = 'sobol', count = 16 }", LIGHT_SAMPLES),
    ] {
        let text = VALID.replace("[render]", &format!("[render]\n{added}"));
        assert_eq!(notes(&text), [expected]);
        let render = parse(&text).unwrap().render;
        assert_eq!((render.ambient, render.shadows), (DVec3::ZERO, Shadows::Opaque));
    }
    for default in [
        "ambient = [0, 0, 0]",
        "shadows = 'opaque'",
        "light_samples = { count = 16 }",
    ] {
        let text = VALID.replace("[render]", &format!("[render]\n{default}"));
        assert_eq!(notes(&text), Vec::<String>::new());
    }
    // The override causes one warning, whatever its value.
    for count in [16, 9] {
        let overrides = Overrides {
            light_samples: Some(count),
            ..Overrides::default()
        };
        let scene = Scene::parse_with(VALID, "s.toml", &overrides).unwrap();
        assert_eq!(scene.notes, [LIGHT_SAMPLES]);
    }
    // The Phong integrator supports all of these keys.
    let text = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n\
                materials.a = { type = 'phong', color = [1, 1, 1] }\n\
                render = { ambient = [1, 1, 1], shadows = 'transparent', light_samples = { count = 4 } }\n";
    assert_eq!(notes(text), Vec::<String>::new());
}

#[test]
fn too_bright_phong_materials_cause_a_note() {
    const RULE: &str =
        "materials: diffuse + specular are scaled down to 1 with integrator = \"path\", which conserves energy: ";
    let (diffuse, specular) = ("diffuse = [0.5, 0, 0]", "specular = [0.5, 0.5, 0.5]");
    for (line, changed, expected) in [
        (diffuse, "diffuse = [0.7, 0.1, 0]", Some("\"red\" (1.2)")),
        (specular, "specular = [0.501, 0, 0]", Some("\"red\" (1.01)")),
        (specular, "specular = [0.5, 1, 1]", None),
        (specular, "specular = [0, 1.5, 1]", Some("\"red\" (1.5)")),
        // The maximum of the texture's colors is [1, 2, 3].
        (diffuse, "diffuse = { texture = 'spots' }", Some("\"red\" (3.5)")),
        (diffuse, "diffuse = { texture = 'dark' }", None),
        (specular, "specular = { texture = 'spots' }", Some("\"red\" (3)")),
    ] {
        let text = with_line(line, changed);
        let expected: Vec<String> = expected
            .map(|expected| format!("{RULE}{expected}"))
            .into_iter()
            .collect();
        assert_eq!(notes(&text), expected, "{changed}");
    }
    // Many materials share one warning.
    let materials: String = (0..10)
        .map(|i| format!("[materials.m{i}]\ntype = 'phong'\ncolor = [0.{i}, 0.8, 0]\n"))
        .collect();
    let found = notes(&VALID.replace("[materials.clay]", &format!("{materials}[materials.clay]")));
    let names: Vec<String> = (0..8).map(|i| format!("\"m{i}\" (1.6)")).collect();
    assert_eq!(found, [format!("{RULE}{} and 2 more", names.join(", "))]);
}

#[test]
fn unused_alpha_causes_a_note() {
    let leaf = |keys: &str| {
        notes(&with_line(
            "[materials.clay]",
            &format!("[materials.leaf]\ntype = 'principled'\n{keys}\n[materials.clay]"),
        ))
    };
    const ALPHA: &str = "materials: alpha has no effect without alpha_mode = \"mask\" or \"blend\"; affected: \"leaf\"";
    const CUTOFF: &str = "materials: alpha_cutoff has no effect without alpha_mode = \"mask\"; affected: \"leaf\"";
    for (keys, expected) in [
        ("alpha = 0.5", vec![ALPHA]),
        ("alpha = { texture = 'spots' }", vec![ALPHA]),
        (
            "alpha = 0\nalpha_mode = 'opaque'\nalpha_cutoff = 0.25",
            vec![ALPHA, CUTOFF],
        ),
        ("alpha = 0.5\nalpha_mode = 'blend'\nalpha_cutoff = 0.25", vec![CUTOFF]),
        ("alpha = 0.5\nalpha_mode = 'blend'", vec![]),
        ("alpha = 0.5\nalpha_mode = 'mask'\nalpha_cutoff = 0.25", vec![]),
        ("alpha = 1\nalpha_cutoff = 0.5", vec![]),
        ("alpha_mode = 'blend'", vec![]),
    ] {
        assert_eq!(leaf(keys), expected, "{keys}");
    }
    let leaves: String = (0..9)
        .map(|i| format!("[materials.leaf{i}]\ntype = 'principled'\nalpha = 0.{i}\n"))
        .collect();
    let found = notes(&with_line("[materials.clay]", &format!("{leaves}[materials.clay]")));
    let names: Vec<String> = (0..8).map(|i| format!("\"leaf{i}\"")).collect();
    let rule = ALPHA.trim_end_matches("\"leaf\"");
    assert_eq!(found, [format!("{rule}{} and 1 more", names.join(", "))]);
}
