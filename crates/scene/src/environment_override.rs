//! Overrides of the environment and of the background that the camera sees.

use std::path::Path;
use std::str::FromStr;

use glam::DVec3;

use super::problem::{At, Problem};
use super::validate::{color, view};
use super::{Description, EnvironmentDescription, EnvironmentName};
use wgray_image::color::srgb_to_linear;

/// The background that the camera sees instead of the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Background {
    /// Transparency; only for [`Integrator::Path`](crate::Integrator::Path).
    Transparent,
    /// A radiance, in linear RGB.
    Color(DVec3),
    /// A color on the display, with components from 0 to 1: the radiance that the view transform and the exposure of
    /// the scene display as this color.
    Display(DVec3),
}

/// Replaces the environment. The new environment takes over `visible` of the old environment, and its `background`
/// unless the new environment has a `background`.
pub(super) fn replace_environment(description: &mut Description, environment: &EnvironmentDescription) {
    let before = description.environment.take();
    let (visible, background) = before.map_or((true, None), |before| (before.visible, before.background));
    description.environment = Some(EnvironmentDescription {
        visible,
        background: environment.background.or(background),
        ..environment.clone()
    });
    description.render.background = DVec3::ZERO;
}

impl Background {
    /// Sets the background that the camera sees. Does not change the light.
    pub(super) fn show(self, description: &mut Description) -> Result<(), Problem> {
        let visible_color = match self {
            Background::Transparent => return transparent(description),
            Background::Color(visible_color) => visible_color,
            Background::Display(displayed) => match view(&description.image) {
                Ok(view) => DVec3::from_array(view.light_of(displayed.to_array())),
                Err(_) => return Ok(()), // reported when the scene is validated
            },
        };
        let visible_color = color(visible_color)?;
        let has_environment = description.integrator().needs_emitters();
        let render = &mut description.render;
        if !has_environment {
            render.background = visible_color;
            return Ok(());
        }
        render.alpha = None;
        let radiance = &mut render.background;
        let constant = || EnvironmentDescription::new(std::mem::take(radiance));
        let environment = description.environment.get_or_insert_with(constant);
        environment.background = Some(visible_color);
        environment.visible = true;
        Ok(())
    }
}

fn transparent(description: &mut Description) -> Result<(), Problem> {
    if description
        .render
        .integrator
        .is_some_and(|integrator| !integrator.follows_paths())
    {
        return Err(Problem::new("transparency needs integrator = \"path\""));
    }
    description.render.alpha = Some(true);
    if let Some(environment) = &mut description.environment {
        environment.background = None;
    }
    Ok(())
}

/// Converts a problem with the environment into a problem with the `--environment` option; `None` if the option does
/// not set the key.
pub(super) fn option_problem(problem: &Problem) -> Option<Problem> {
    let key = problem.key.to_string();
    let is_set_by_option = matches!(key.strip_prefix("environment"), Some("" | ".color" | ".file"));
    is_set_by_option.then(|| Problem::new(problem.message.as_str()).at("environment"))
}

impl FromStr for Background {
    type Err = String;

    /// Parses `none`, `transparent`, or a color.
    fn from_str(text: &str) -> Result<Background, String> {
        if text == "none" || text == "transparent" {
            return Ok(Background::Transparent);
        }
        let display = parse_display_color(text).map(Background::Display);
        let found = display.or_else(|| parse_linear_color(text).map(Background::Color));
        found.ok_or_else(|| format!("must be none or a color, {COLOR_EXAMPLES}"))
    }
}

impl FromStr for EnvironmentDescription {
    type Err = String;

    /// Parses the name of a built-in environment, a color, or the path of an image, relative to the current folder.
    fn from_str(text: &str) -> Result<EnvironmentDescription, String> {
        let builtin = EnvironmentName::ALL.into_iter().find(|name| name.name() == text);
        if let Some(name) = builtin {
            return Ok(EnvironmentDescription::named(name));
        }
        if let Some(color) = parse_color(text) {
            return Ok(EnvironmentDescription::new(color));
        }
        let rule =
            || format!("must be studio, sky, an image file (.hdr, .exr, .png, .jpg) or a color, {COLOR_EXAMPLES}");
        let is_path = text.contains(['/', '\\', '.']) || Path::new(text).exists();
        if text.starts_with('#') || !is_path {
            return Err(rule());
        }
        let path = std::path::absolute(text).map_err(|_| rule())?;
        let path = path.to_str().ok_or("the current folder's name must be UTF-8")?;
        Ok(EnvironmentDescription::image(path))
    }
}

/// Examples of colors in messages.
const COLOR_EXAMPLES: &str = "such as white, #ff8000 or 1,0.2,0 (linear)";

const COLOR_NAMES: [(&str, &str); 4] = [
    ("black", "#000000"),
    ("gray", "#808080"),
    ("grey", "#808080"),
    ("white", "#ffffff"),
];

/// Parses a color to linear RGB: a name or hexadecimal digits (sRGB-encoded), or three linear numbers.
fn parse_color(text: &str) -> Option<DVec3> {
    let to_linear = |display: DVec3| DVec3::from_array(display.to_array().map(srgb_to_linear));
    parse_display_color(text)
        .map(to_linear)
        .or_else(|| parse_linear_color(text))
}

/// Parses a name, `#rrggbb` or `#rgb`, with or without `#`, to display values, 0 to 1.
fn parse_display_color(text: &str) -> Option<DVec3> {
    let named = COLOR_NAMES.into_iter().find(|(name, _)| *name == text);
    let hex = named.map_or(text, |(_, hex)| hex);
    let digits = hex.strip_prefix('#').unwrap_or(hex);
    let (max, bits) = match digits.len() {
        3 => (15.0, 4),
        6 => (255.0, 8),
        _ => return None,
    };
    let is_hex = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let packed = u32::from_str_radix(digits, 16).ok().filter(|_| is_hex)?;
    let component = |i: u32| f64::from(packed >> (i * bits) & ((1 << bits) - 1)) / max;
    Some(DVec3::new(component(2), component(1), component(0)))
}

fn parse_linear_color(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|number| number.trim().parse().ok())
        .collect::<Option<_>>()?;
    Some(DVec3::from_array(numbers.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Overrides, Scene, SceneError};

    const SCENE: &str = "\
image = { width = 4, height = 3 }
camera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 40 }
";

    fn load(extra: &str, overrides: &Overrides) -> Result<Scene, SceneError> {
        Scene::parse_with(&format!("{SCENE}{extra}"), "s.toml", overrides)
    }

    #[test]
    fn colors_are_display_values_or_linear_radiance() {
        let linear = |text: &str| parse_color(text).unwrap().to_array();
        assert_eq!(linear("#ffffff"), [1.0; 3]);
        assert_eq!(linear("#000000"), [0.0; 3]);
        assert_eq!(linear("1,0.25, 20"), [1.0, 0.25, 20.0]);
        assert_eq!("#ff0000".parse(), Ok(Background::Display(DVec3::X)));
        assert_eq!("1,0,0".parse(), Ok(Background::Color(DVec3::X)));
        // Computed by hand from IEC 61966-2-1: 0x80 is 128 / 255 = 0.50196, and ((0.50196 + 0.055) / 1.055)^2.4 =
        // 0.21586.
        let [r, g, b] = linear("#8000Ff");
        assert!((r - 0.21586).abs() < 1e-5 && g == 0.0 && b == 1.0, "{r} {g} {b}");
        assert_eq!("none".parse(), Ok(Background::Transparent));
        assert_eq!("transparent".parse(), Ok(Background::Transparent));
        for green in ["#0f0", "0f0", "00ff00", "#00FF00"] {
            assert_eq!(green.parse(), Ok(Background::Display(DVec3::Y)), "{green}");
        }
        assert_eq!(linear("#842")[0], linear("#884422")[0]);
        for invalid in [
            "", "#", "#ff", "#ffff", "+12", "##12345", "#12345g", "#+12345", "#1234567", "1,2", "1,2,3,4", "1,2,x",
            "blue", "None",
        ] {
            let message = invalid.parse::<Background>().unwrap_err();
            assert!(
                message.starts_with("must be none or a color, such as white"),
                "{invalid}: {message}"
            );
        }
    }

    #[test]
    fn environments_are_names_colors_or_files() {
        let parse = |text: &str| text.parse::<EnvironmentDescription>().unwrap();
        assert_eq!(parse("studio"), EnvironmentDescription::named(EnvironmentName::Studio));
        assert_eq!(parse("sky"), EnvironmentDescription::named(EnvironmentName::Sky));
        assert_eq!(parse("1,2,3"), EnvironmentDescription::new([1.0, 2.0, 3.0]));
        let current_folder = std::env::current_dir().unwrap();
        for (text, path) in [("./studio", "studio"), ("a/b.hdr", "a/b.hdr"), ("1,2.5", "1,2.5")] {
            let file = parse(text).file.unwrap();
            assert_eq!(std::path::Path::new(&file), current_folder.join(path));
        }
        for invalid in ["", "#ff", "forest", "1,2"] {
            let message = invalid.parse::<EnvironmentDescription>().unwrap_err();
            assert!(
                message.starts_with("must be studio, sky, an image file (.hdr"),
                "{message}"
            );
        }
    }

    #[test]
    fn overrides_replace_the_light_and_the_visible_background() {
        let path = "render = { integrator = 'path', alpha = true, background = [1, 2, 3] }\n";
        let color = |color: [f64; 3]| Some(Background::Color(color.into()));
        let overrides = |environment: Option<&str>, background| Overrides {
            environment: environment.map(|text| text.parse().unwrap()),
            background,
            ..Overrides::default()
        };
        let loaded = |extra: &str, options: &Overrides| {
            let scene = load(extra, options).unwrap();
            let environment = scene.environment.map(|environment| {
                (
                    environment.color.to_array(),
                    environment.visible,
                    environment.background,
                )
            });
            (environment, scene.render.alpha)
        };
        let (light, red) = ([1.0, 2.0, 3.0], [1.0, 0.0, 0.0]);
        assert_eq!(loaded(path, &overrides(None, None)), (Some((light, true, None)), true));
        let red_background = Some(DVec3::from(red));
        assert_eq!(
            loaded(path, &overrides(None, color(red))),
            (Some((light, true, red_background)), false)
        );
        let gray = Some(([0.5; 3], true, None));
        assert_eq!(loaded(path, &overrides(Some("0.5,0.5,0.5"), None)), (gray, true));
        assert_eq!(
            loaded(path, &overrides(Some("0.5,0.5,0.5"), color(red))),
            (Some(([0.5; 3], true, red_background)), false)
        );
        let opaque = path.replace("alpha = true, ", "");
        let clear = overrides(None, Some(Background::Transparent));
        assert_eq!(loaded(&opaque, &clear), (Some((light, true, None)), true));
        // The background also applies if there is no environment, or if the environment is invisible.
        let dark = "render.integrator = 'path'\n";
        assert_eq!(
            loaded(dark, &overrides(None, color(red))),
            (Some(([0.0; 3], true, red_background)), false)
        );
        assert_eq!(loaded(dark, &overrides(None, color([0.0; 3]))), (None, false));
        let invisible = format!("{dark}environment = {{ color = [1, 2, 3], visible = false }}\n");
        assert_eq!(
            loaded(&invisible, &overrides(None, None)),
            (Some((light, false, None)), false)
        );
        assert_eq!(
            loaded(&invisible, &overrides(Some("0.5,0.5,0.5"), None)),
            (Some(([0.5; 3], false, None)), false)
        );
        assert_eq!(
            loaded(&invisible, &overrides(None, color(red))),
            (Some((light, true, red_background)), false)
        );
        // Phong uses `render.background`.
        let scene = load("render.background = [1, 2, 3]\n", &overrides(None, color(red))).unwrap();
        assert_eq!((scene.render.background.to_array(), scene.environment), (red, None));
    }

    #[test]
    fn a_display_color_is_displayed_unchanged() {
        for (transform, exposure) in [
            ("agx", 0.0),
            ("khronos-pbr-neutral", 1.5),
            ("srgb", -1.0),
            ("gamma22", 0.0),
        ] {
            for integrator in ["path", "phong"] {
                let text = SCENE.replace(
                    "height = 3",
                    &format!("height = 3, view_transform = '{transform}', exposure = {exposure}"),
                );
                for (color, expected) in [("#ffffff", [255; 3]), ("#6480a0", [100, 128, 160])] {
                    let overrides = Overrides {
                        background: Some(color.parse().unwrap()),
                        ..Overrides::default()
                    };
                    let text = format!("{text}render.integrator = '{integrator}'\n");
                    let scene = Scene::parse_with(&text, "s.toml", &overrides).unwrap();
                    let background = match &scene.environment {
                        Some(environment) => environment.background.unwrap(),
                        None => scene.render.background,
                    };
                    assert_eq!(scene.view.rgb8(background.as_vec3().to_array()), expected, "{text}");
                }
            }
        }
    }

    #[test]
    fn errors_name_the_environment_or_background_option() {
        let load_error = |extra: &str, environment: Option<&str>, background: Option<&str>| {
            let overrides = Overrides {
                environment: environment.map(|text| text.parse().unwrap()),
                background: background.map(|text| text.parse().unwrap()),
                ..Overrides::default()
            };
            load(extra, &overrides).unwrap_err()
        };
        let (path, phong) = ("render.integrator = 'path'\n", "render.integrator = 'phong'\n");
        for (extra, environment, background, expected) in [
            (phong, Some("sky"), None, "environment: needs integrator = \"path\""),
            (
                phong,
                None,
                Some("none"),
                "background: transparency needs integrator = \"path\"",
            ),
            ("", None, Some("1,2,-1"), "background: -1 must be from 0 to 1e6"),
            (path, None, Some("nan,2,1"), "background: nan must be from 0 to 1e6"),
            (path, Some("1,2e6,0"), None, "environment: 2e6 must be from 0 to 1e6"),
            (
                path,
                Some("/nowhere/room.hdr"),
                None,
                "environment: \"/nowhere/room.hdr\" cannot be read: ",
            ),
        ] {
            let error = load_error(extra, environment, background);
            assert!(matches!(error, SceneError::Override(_)), "{error}");
            assert!(error.to_string().starts_with(expected), "{error}: {expected}");
        }
        // Errors in values from the scene file are reported at their location in that file.
        let error = load_error(
            &format!("{path}materials.a = {{ type = 'glass', ior = 0 }}\n"),
            Some("sky"),
            None,
        );
        assert!(error.to_string().starts_with("s.toml:4: materials.a.ior"), "{error}");
    }
}
