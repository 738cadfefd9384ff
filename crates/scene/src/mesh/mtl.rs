//! Parser of MTL files, the materials of OBJ files (Wavefront Technologies, "Advanced Visualizer Manual", 1995).
//! Invalid lines are reported and ignored. Keywords are case-insensitive, because exporters spell them differently.

use super::MtlMaterial;
use super::error::{MeshFault, quoted};
use super::tokens::{Tokens, number};

/// Maximum number of materials of a file. A material takes hundreds of bytes in memory, but may take only nine bytes in
/// the file.
pub(super) const MAX_MATERIALS: usize = 1 << 16;
/// Maximum number of reported invalid lines.
const MAX_PROBLEMS: usize = 100;
/// Maximum number of reported statements without effect per material.
const MAX_IGNORED: usize = 16;

#[derive(Debug, Default)]
pub(super) struct Mtl {
    pub materials: Vec<MtlMaterial>,
    /// Messages about the first invalid lines.
    pub problems: Vec<String>,
    /// Number of invalid lines.
    pub problem_count: usize,
}

/// Parses a file. Problems begin with the line number; the error applies to the file as a whole.
pub(super) fn read(bytes: &[u8]) -> Result<Mtl, String> {
    let mut words = Tokens::new(bytes);
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let (mut problems, mut problem_count) = (Vec::new(), 0);
    while let Some(keyword) = words.next_word() {
        let line = words.line();
        if keyword.eq_ignore_ascii_case(b"newmtl") {
            if materials.len() >= MAX_MATERIALS {
                return Err(format!("it must have at most {MAX_MATERIALS} materials"));
            }
            materials.push(MtlMaterial {
                name: words.name(),
                line,
                ..MtlMaterial::default()
            });
        } else if let Some(material) = materials.last_mut()
            && let Err(fault) = set(material, keyword, &mut words)
        {
            problem_count += 1;
            if problems.len() < MAX_PROBLEMS {
                problems.push(fault);
            }
        }
        words.next_line();
    }
    Ok(Mtl {
        materials,
        problems,
        problem_count,
    })
}

/// Lower-case keywords and their usual spelling.
const KEYWORDS: [(&str, &str); 24] = [
    ("bump", "map_Bump"),
    ("d", "d"),
    ("decal", "decal"),
    ("disp", "disp"),
    ("illum", "illum"),
    ("kd", "Kd"),
    ("ke", "Ke"),
    ("ks", "Ks"),
    ("map_bump", "map_Bump"),
    ("map_d", "map_d"),
    ("map_kd", "map_Kd"),
    ("map_ke", "map_Ke"),
    ("map_ks", "map_Ks"),
    ("map_ns", "map_Ns"),
    ("map_pm", "map_Pm"),
    ("map_pr", "map_Pr"),
    ("map_tr", "map_Tr"),
    ("ni", "Ni"),
    ("norm", "norm"),
    ("ns", "Ns"),
    ("pm", "Pm"),
    ("pr", "Pr"),
    ("refl", "refl"),
    ("tr", "Tr"),
];

/// Applies a line. The error contains the line number, the keyword and the rule.
fn set(material: &mut MtlMaterial, keyword: &[u8], words: &mut Tokens) -> Result<(), String> {
    let is_keyword = |(lower, _): &&(&str, &str)| lower.as_bytes().eq_ignore_ascii_case(keyword);
    let Some((_, keyword)) = KEYWORDS.iter().find(is_keyword) else {
        return Ok(());
    };
    let line = words.line();
    let message = |fault: MeshFault| format!("{line}: {}", fault.message);
    let finite = |words: &mut Tokens| -> Result<f64, String> {
        let x = words.number(keyword).map_err(message)?;
        match x.is_finite() {
            true => Ok(x),
            false => Err(format!("{line}: {keyword}: {x} must be finite")),
        }
    };
    // A single number is a gray value.
    let color = |words: &mut Tokens| -> Result<[f64; 3], String> {
        let red = finite(words)?;
        match words.next_on_line() {
            None => Ok([red; 3]),
            Some(word) => match number(word).filter(|green| green.is_finite()) {
                Some(green) => Ok([red, green, finite(words)?]),
                None => Err(format!("{line}: {keyword}: a color must be three numbers")),
            },
        }
    };
    match *keyword {
        "Kd" => material.diffuse = Some(color(words)?),
        "Ks" => material.specular = Some(color(words)?),
        "Ke" => material.emission = Some(color(words)?),
        "Ns" => material.shininess = Some(finite(words)?),
        "Ni" => material.index_of_refraction = Some(finite(words)?),
        "d" => material.opacity = Some(finite(words)?),
        "Tr" => {
            // `Tr 1` counts as opaque: MeshLab writes 1 for opaque materials, and a fully transparent material would be
            // useless.
            let opacity = 1.0 - finite(words)?;
            if opacity != 0.0 {
                material.opacity = Some(opacity);
                material.lines.insert("d".to_owned(), line);
            }
        }
        "illum" => material.illumination = Some(finite(words)?.clamp(0.0, 255.0) as u8),
        "Pm" => material.metallic = Some(finite(words)?),
        "Pr" => material.roughness = Some(finite(words)?),
        "map_Kd" => material.diffuse_map = map(material, words, keyword),
        "map_Ke" => material.emission_map = map(material, words, keyword),
        "map_d" => material.opacity_map = map(material, words, keyword),
        "map_Bump" => material.bump_map = map(material, words, keyword),
        "norm" => material.normal_map = map(material, words, keyword),
        "map_Pm" => material.metallic_map = map(material, words, keyword),
        "map_Pr" => material.roughness_map = map(material, words, keyword),
        _ => record_ignored(material, (*keyword).to_owned(), line),
    }
    material.lines.insert((*keyword).to_owned(), line);
    Ok(())
}

fn map(material: &mut MtlMaterial, words: &mut Tokens, keyword: &str) -> Option<String> {
    let line = words.line();
    let (file, options) = map_file(&words.name());
    for option in options {
        record_ignored(
            material,
            format!("option {} of {keyword}", quoted(option.as_bytes())),
            line,
        );
    }
    Some(file).filter(|file| !file.is_empty())
}

/// Records a statement that has no effect. At most [`MAX_IGNORED`] are recorded.
fn record_ignored(material: &mut MtlMaterial, statement: String, line: usize) {
    if material.others.len() < MAX_IGNORED && !material.others.contains(&statement) {
        material.lines.insert(statement.clone(), line);
        material.others.push(statement);
    }
}

fn map_file(line: &str) -> (String, Vec<String>) {
    let mut words = line.split(' ').peekable();
    let mut options = Vec::new();
    while let Some(option) = words.next_if(|word| word.starts_with('-')) {
        if options.len() < MAX_IGNORED {
            options.push(option.to_owned());
        }
        let numbers = match option {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        for i in 0..numbers {
            // Only the first argument of an option is required.
            if i == 0 || words.peek().is_some_and(|word| word.parse::<f64>().is_ok()) {
                words.next();
            }
        }
    }
    let file = words.collect::<Vec<_>>().join(" ");
    (file.trim_matches('"').to_owned(), options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_values_of_materials_are_read() {
        let text = "# two\nKd 9 9 9\nnewmtl dark red\nKd 0.5 0.1 0.2\nKs 0.25\nNs 10\nKe 1 2 3\nd 0.5\nNi 1.5\nillum 2\n\
                    map_Kd -s 2 2 -clamp on my wood.png\nmap_Bump b.png\nMAP_BUMP b.png\nmap_Ka a.png\n\nNewMtl glass\r\ntr 0.75\r\n\
                    map_kd \"a.png\"\r\n";
        let Mtl {
            materials, problems, ..
        } = read(text.as_bytes()).unwrap();
        assert_eq!(problems, Vec::<String>::new());
        let lines = |lines: &[(&str, usize)]| lines.iter().map(|(key, line)| (key.to_string(), *line)).collect();
        let red = MtlMaterial {
            name: "dark red".to_string(),
            line: 3,
            diffuse: Some([0.5, 0.1, 0.2]),
            specular: Some([0.25; 3]),
            shininess: Some(10.0),
            emission: Some([1.0, 2.0, 3.0]),
            opacity: Some(0.5),
            index_of_refraction: Some(1.5),
            illumination: Some(2),
            diffuse_map: Some("my wood.png".to_string()),
            bump_map: Some("b.png".to_string()),
            others: vec![
                "option \"-s\" of map_Kd".to_string(),
                "option \"-clamp\" of map_Kd".to_string(),
            ],
            lines: lines(&[
                ("Kd", 4),
                ("Ks", 5),
                ("Ns", 6),
                ("Ke", 7),
                ("d", 8),
                ("Ni", 9),
                ("illum", 10),
                ("map_Kd", 11),
                ("option \"-s\" of map_Kd", 11),
                ("option \"-clamp\" of map_Kd", 11),
                ("map_Bump", 13),
            ]),
            ..MtlMaterial::default()
        };
        let glass = MtlMaterial {
            name: "glass".to_string(),
            line: 16,
            diffuse_map: Some("a.png".to_string()),
            opacity: Some(0.25),
            lines: lines(&[("Tr", 17), ("d", 17), ("map_Kd", 18)]),
            ..MtlMaterial::default()
        };
        assert_eq!(materials, [red, glass]);
    }

    #[test]
    fn invalid_lines_are_reported() {
        let Mtl {
            materials, problems, ..
        } = read(b"newmtl a\nKd spectral a.rfl\nNs inf\nKd 1 b\nd 0.5").unwrap();
        assert_eq!(
            problems,
            [
                "2: Kd: \"spectral\" must be a number",
                "3: Ns: inf must be finite",
                "4: Kd: a color must be three numbers"
            ]
        );
        assert_eq!((materials[0].diffuse, materials[0].opacity), (None, Some(0.5)));
    }

    #[test]
    fn the_numbers_of_problems_and_materials_are_limited() {
        let invalid = format!("newmtl a\n{}", "Kd x\n".repeat(100_000));
        let Mtl {
            problems,
            problem_count,
            ..
        } = read(invalid.as_bytes()).unwrap();
        assert_eq!((problems.len(), problem_count), (MAX_PROBLEMS, 100_000));
        let read_materials = |count: usize| read("newmtl a\n".repeat(count).as_bytes());
        assert_eq!(read_materials(MAX_MATERIALS).unwrap().materials.len(), MAX_MATERIALS);
        assert_eq!(
            read_materials(MAX_MATERIALS + 1).unwrap_err(),
            "it must have at most 65536 materials"
        );
    }
}
