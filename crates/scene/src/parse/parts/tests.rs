//! Tests that parsing a text in parts and as a whole gives the same result.

use super::*;
use crate::Description;
use crate::error::SceneError;
use crate::parse::{Defines, invalid, read_file};

const START: &str = "\
image = { width = 4, height = 4 }
camera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }
";
const POINT: &str = "[[lights]]\ntype = 'point'\nposition = [0, 0, 3]\ncolor = [1, 1, 1]\n";
const SPHERE: &str = "[[shapes]]\ntype = 'sphere'\nmaterial = 'a'\ncenter = [0, 0, 0]\nradius = 1\n";
const RED: &str = "[materials.a]\ntype = 'phong'\ncolor = [1, 0, 0]\n";
const BLUE: &str = "[materials.\"b c\"]\ntype = 'phong'\ncolor = [0, 0, 1]\n";

fn parse_whole(text: &str) -> Result<Description, SceneError> {
    let table = toml::from_str(text).map_err(|error| SyntaxFault::of(0, &error).into_error(text, "s"))?;
    read_file(table).map_err(|problems| invalid(text, "s", problems, &Defines::new(&[])))
}

fn parse_by_parts(text: &str) -> Result<Description, String> {
    Description::parse(text, "s").map_err(|error| error.to_string())
}

fn assert_same(text: &str) {
    match (parse_whole(text), parse_by_parts(text)) {
        (Ok(whole), Ok(parts)) => assert!(whole == parts, "{text}"),
        (Err(whole), Err(parts)) => assert_eq!(whole.to_string(), parts, "{text}"),
        (whole, parts) => panic!("{text}\n{whole:?}\n{parts:?}"),
    }
}

#[test]
fn parsing_by_parts_gives_the_same_result() {
    let subtable = "[materials.a.normal_map]\ntexture = 't'\n";
    let image = "[textures.t]\ntype = 'image'\nfile = 'a [[shapes]] b'\n";
    let unusual = "[[ shapes ]] # [[lights]]\n type = \"\"\"sphere\"\"\"\nmaterial = '[[shapes]]'\ncenter = [ # [x]\n0,\n\
                   [[shapes]]\n][0:0]";
    let nested = "[[shapes]]\r\ntype = 'triangle'\r\nmaterial = 'a'\r\nvertices = [\r\n[0, 0, 0],\r\n  [1, 0, 0],\r\n[0, 1, 0]]\r\n";
    let text = "[materials.z]\ntype = 'phong'\n[materials.z.color]\ntexture = \"\"\"\n[[shapes]]\n\"\"\"\n";
    let render = "[render]\nseed = 3\n[render.pixel_samples]\ncount = 4\n";
    let pieces = [POINT, SPHERE, RED, BLUE, subtable, image, nested, text, render];
    // All sequences of three pieces; misplaced subtables and duplicate tables are errors.
    for a in pieces {
        for b in pieces {
            for c in pieces {
                assert_same(&format!("{START}{a}{b}{c}"));
            }
        }
    }
    assert_same(&format!("{START}{unusual}"));
    assert_same(&format!("\u{feff}{START}{SPHERE}{RED}"));
    assert_same(&format!("{START}shapes = []\n{RED}"));
    assert_same(&format!(
        "{START}lights = [{{ type = 'point', position = [0, 0, 3], color = [1, 1, 1] }}]\n{SPHERE}{RED}"
    ));
    assert_same(&format!("{START}[materials]\n{RED}{SPHERE}"));
    assert_same(&format!("{START}[materials]\nb = {{ type = 'mirror' }}\n{RED}{SPHERE}"));
    assert_same(&format!("{START}materials.b.type = 'mirror'\n{RED}{SPHERE}"));
    assert_same(&format!("{START}[\"materials\".b]\ntype = 'mirror'\n{RED}{SPHERE}"));
    let parts = Parts::of(&format!("{START}{RED}{subtable}{BLUE}{SPHERE}{SPHERE}{render}{POINT}"))
        .parts
        .len();
    assert_eq!(parts, 5);
}

#[test]
fn parsing_by_parts_gives_the_same_errors() {
    let valid = format!(
        "{START}{POINT}{RED}{render}{SPHERE}{BLUE}{SPHERE}{POINT}",
        render = "[render]\nseed = 3\n"
    );
    assert_same(&valid);
    // Each line is removed, duplicated or truncated, or text is inserted before the line.
    let lines: Vec<&str> = valid.lines().collect();
    for i in 0..lines.len() {
        let line = lines[i];
        let half = &line[..line.len() / 2];
        for replacement in [
            String::new(),
            format!("{line}\n{line}"),
            half.to_owned(),
            format!("{half}\n{line}"),
            format!("x = 3\n{line}"),
            format!("[shapes.b]\n{line}"),
            format!("[[lights.b]]\n{line}"),
            format!("[\n{line}"),
            format!("[[shapes]] {line}"),
            format!("= {line}"),
            format!("x = [\n{line}"),
            format!("x = \"\"\"\n{line}"),
            format!("{line}\n\u{7}"),
            line.replace("type = '", "type = 'x"),
            line.replace("[0", "['x'"),
        ] {
            let mut changed: Vec<&str> = lines.clone();
            changed[i] = &replacement;
            assert_same(&changed.join("\n"));
        }
    }
}

#[test]
fn sizes_of_parts_and_whole_files_are_limited() {
    let elements = "[0, 0, 0],".repeat(MAX_PART_BYTES / 10 + 1);
    let error_of = |text: &str| parse_by_parts(text).unwrap_err();
    let large_part = format!("{START}{RED}[[shapes]]\nx = [{elements}]\n");
    assert_eq!(
        error_of(&large_part),
        "s:6:1: the table that starts here is larger than 4 MiB"
    );
    let rest = format!("{START}x = [{elements}]\n{SPHERE}");
    assert!(error_of(&rest).starts_with("s:1:1: "));
    assert!(
        error_of(&rest)
            .contains("in a file larger than 4 MiB, every texture, material, light, shape, mesh and instance")
    );
    let spheres = SPHERE.repeat(MAX_PART_BYTES / SPHERE.len() + 1);
    assert!(parse_by_parts(&format!("{START}{spheres}{RED}")).unwrap().shapes.len() > 50_000);
    assert!(error_of(&format!("{START}{spheres}[materials]\n{RED}")).contains("must have its own header"));
    let invalid = format!("{START}{spheres}{RED}[render]\nseed = -1\n");
    let line = 1 + invalid[..invalid.len() - 10].matches('\n').count();
    assert!(
        error_of(&invalid).starts_with(&format!("s:{line}: render.seed: -1 ")),
        "{}",
        error_of(&invalid)
    );
    let invalid = format!(
        "{START}{RED}{spheres}{}{BLUE}",
        BLUE.replace("b c", "d").replace("color", "colour")
    );
    let line = invalid.matches('\n').count() - 3;
    assert!(
        error_of(&invalid).starts_with(&format!("s:{line}: materials.d.colour: ")),
        "{}",
        error_of(&invalid)
    );
    let duplicate = error_of(&format!("{START}{RED}{spheres}{RED}"));
    assert!(
        duplicate.contains("duplicate key") && !duplicate.starts_with("s:3:"),
        "{duplicate}"
    );
    let invalid = format!("{START}{spheres}{}", SPHERE.replace("radius", "size"));
    let line = invalid.matches('\n').count();
    assert!(
        error_of(&invalid).starts_with(&format!("s:{line}: shapes[")),
        "{}",
        error_of(&invalid)
    );
}
