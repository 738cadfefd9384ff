//! The materials that an OBJ file names: MTL files, as of Wavefront's "Advanced Visualizer Manual", 1995. A line that cannot
//! be read is told and left out. Keywords may have any case, as those of many exporters have.

use super::MtlMaterial;
use super::words::{Words, number};

/// The most materials of a file: each takes a few hundred bytes, and may have nine in the file.
pub(super) const MOST_MATERIALS: usize = 1 << 16;
/// How many lines that cannot be read are told apart.
const MOST_PROBLEMS: usize = 100;

/// What is in a file.
#[derive(Debug, Default)]
pub(super) struct Mtl {
    pub materials: Vec<MtlMaterial>,
    /// The first lines that cannot be read, each with the rule, and how many there are.
    pub problems: Vec<String>,
    pub problem_count: usize,
}

/// Reads the materials of a file. Messages begin with the line. The error is a rule that the whole file breaks.
pub(super) fn read(bytes: &[u8]) -> Result<Mtl, String> {
    let mut words = Words::new(bytes);
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let (mut problems, mut problem_count) = (Vec::new(), 0);
    while let Some(keyword) = words.anywhere() {
        let line = words.line();
        if keyword.eq_ignore_ascii_case(b"newmtl") {
            if materials.len() >= MOST_MATERIALS {
                return Err(format!("it must have at most {MOST_MATERIALS} materials"));
            }
            materials.push(MtlMaterial {
                name: words.name(),
                line,
                ..MtlMaterial::default()
            });
        } else if let Some(material) = materials.last_mut()
            && let Err(fault) = set(material, &keyword.to_ascii_lowercase(), &mut words)
        {
            problem_count += 1;
            if problems.len() < MOST_PROBLEMS {
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

/// Sets a field of a material by a line. The error is the line and the rule.
fn set(material: &mut MtlMaterial, keyword: &[u8], words: &mut Words) -> Result<(), String> {
    let told = |fault: super::error::Fault| match fault.place {
        super::error::Place::Line(line) => format!("{line}: {}", fault.message),
        _ => fault.message,
    };
    let finite = |words: &mut Words| -> Result<f64, String> {
        let x = words.number("the value").map_err(told)?;
        match x.is_finite() {
            true => Ok(x),
            false => Err(told(words.fault(format!("{x} must be finite")))),
        }
    };
    // One number stands for three.
    let color = |words: &mut Words| -> Result<[f64; 3], String> {
        let red = finite(words)?;
        match words.on_line() {
            None => Ok([red; 3]),
            Some(word) => match number(word).filter(|green| green.is_finite()) {
                Some(green) => Ok([red, green, finite(words)?]),
                None => Err(told(words.fault("a colour must be three numbers"))),
            },
        }
    };
    match keyword {
        b"kd" => material.diffuse = Some(color(words)?),
        b"ks" => material.specular = Some(color(words)?),
        b"ke" => material.emission = Some(color(words)?),
        b"ns" => material.shininess = Some(finite(words)?),
        b"ni" => material.index_of_refraction = Some(finite(words)?),
        b"d" => material.opacity = Some(finite(words)?),
        b"tr" => {
            // MeshLab writes 1 for opaque materials, and an invisible one has no use.
            let opacity = 1.0 - finite(words)?;
            material.opacity = Some(opacity).filter(|opacity| *opacity != 0.0).or(material.opacity);
        }
        b"illum" => material.illumination = Some(finite(words)?.clamp(0.0, 255.0) as u8),
        b"pm" => material.metallic = Some(finite(words)?),
        b"pr" => material.roughness = Some(finite(words)?),
        b"map_kd" => material.diffuse_map = map(material, words, "the options of map_Kd"),
        b"map_ke" => material.emission_map = map(material, words, "the options of map_Ke"),
        b"map_d" => material.opacity_map = map(material, words, "the options of map_d"),
        b"map_bump" | b"bump" => material.bump_map = map(material, words, "the options of map_Bump"),
        b"norm" => material.normal_map = map(material, words, "the options of norm"),
        b"map_pm" => material.metallic_map = map(material, words, "the options of map_Pm"),
        b"map_pr" => material.roughness_map = map(material, words, "the options of map_Pr"),
        _ => {
            if let Some((_, told)) = OTHERS.iter().find(|(known, _)| known.as_bytes() == keyword) {
                left_out(material, told);
            }
        }
    }
    Ok(())
}

/// Maps that are not read, in lower case, and what they are called. That of the ambient light is mostly `map_Kd` again.
const OTHERS: [(&str, &str); 6] = [
    ("decal", "decal"),
    ("disp", "disp"),
    ("map_ks", "map_Ks"),
    ("map_ns", "map_Ns"),
    ("map_tr", "map_Tr"),
    ("refl", "refl"),
];

/// Returns the file of a map. Its options have no effect.
fn map(material: &mut MtlMaterial, words: &mut Words, options: &'static str) -> Option<String> {
    let (file, has_options) = map_file(&words.name());
    if has_options {
        left_out(material, options);
    }
    Some(file).filter(|file| !file.is_empty())
}

fn left_out(material: &mut MtlMaterial, what: &'static str) {
    if !material.others.contains(&what) {
        material.others.push(what);
    }
}

/// The file of a map, behind its options, and whether there are options.
fn map_file(line: &str) -> (String, bool) {
    let mut words = line.split(' ').peekable();
    let mut has_options = false;
    while let Some(option) = words.next_if(|word| word.starts_with('-')) {
        has_options = true;
        let numbers = match option {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        for i in 0..numbers {
            // Of three numbers the first must be there.
            if i == 0 || words.peek().is_some_and(|word| word.parse::<f64>().is_ok()) {
                words.next();
            }
        }
    }
    let file = words.collect::<Vec<_>>().join(" ");
    (file.trim_matches('"').to_owned(), has_options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_have_their_values() {
        let text = "# two\nKd 9 9 9\nnewmtl dark red\nKd 0.5 0.1 0.2\nKs 0.25\nNs 10\nKe 1 2 3\nd 0.5\nNi 1.5\nillum 2\n\
                    map_Kd -s 2 2 -clamp on my wood.png\nmap_Bump b.png\nMAP_BUMP b.png\nmap_Ka a.png\n\nNewMtl glass\r\ntr 0.75\r\n\
                    map_kd \"a.png\"\r\n";
        let Mtl {
            materials, problems, ..
        } = read(text.as_bytes()).unwrap();
        assert_eq!(problems, Vec::<String>::new());
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
            others: vec!["the options of map_Kd"],
            ..MtlMaterial::default()
        };
        let glass = MtlMaterial {
            name: "glass".to_string(),
            line: 16,
            diffuse_map: Some("a.png".to_string()),
            opacity: Some(0.25),
            ..MtlMaterial::default()
        };
        assert_eq!(materials, [red, glass]);
    }

    #[test]
    fn what_cannot_be_read_is_told() {
        let Mtl {
            materials, problems, ..
        } = read(b"newmtl a\nKd spectral a.rfl\nNs inf\nKd 1 b\nd 0.5").unwrap();
        assert_eq!(
            problems,
            [
                "2: the value: \"spectral\" must be a number",
                "3: inf must be finite",
                "4: a colour must be three numbers"
            ]
        );
        assert_eq!((materials[0].diffuse, materials[0].opacity), (None, Some(0.5)));
    }

    #[test]
    fn files_of_lines_alone_take_little() {
        let bad = format!("newmtl a\n{}", "Kd x\n".repeat(100_000));
        let Mtl {
            problems,
            problem_count,
            ..
        } = read(bad.as_bytes()).unwrap();
        assert_eq!((problems.len(), problem_count), (MOST_PROBLEMS, 100_000));
        let many = |count: usize| read("newmtl a\n".repeat(count).as_bytes());
        assert_eq!(many(MOST_MATERIALS).unwrap().materials.len(), MOST_MATERIALS);
        assert_eq!(
            many(MOST_MATERIALS + 1).unwrap_err(),
            "it must have at most 65536 materials"
        );
    }
}
