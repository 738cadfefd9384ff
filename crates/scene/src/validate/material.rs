//! Validation of materials.

use glam::DVec3;

use super::path::needs_path;
use super::texture::Textures;
use super::{At, Checked, Color, Problem, between, check, number};
use crate::limits::{ABSORPTIONS, ETAS, FRACTIONS, IORS, KS, ROTATIONS, SHININESS};
use crate::{
    ColorDescription, ConductorDescription, Facets, Material, MaterialDescription, MetalIndex, PhongDescription,
    Reflection, ValueDescription,
};

impl Textures<'_> {
    fn emission(&self, description: &Option<ColorDescription>) -> Checked<Color> {
        let Some(emission) = description else {
            return Ok(Color::BLACK);
        };
        needs_path(self.integrator)?;
        let color = self.color(emission)?;
        // An image that is damaged or not read is replaced by a constant color, with which the entire surface would
        // emit. Such a material emits nothing.
        let is_replaced = matches!(color, Color::Texture(texture) if self.replaced.contains(&texture));
        Ok(if is_replaced { Color::BLACK } else { color })
    }

    fn check_path_type(&self, tag: &str) -> Checked<()> {
        let with_type = |problem: Problem| Problem::new(format!("{tag:?} {}", problem.message));
        needs_path(self.integrator).map_err(with_type).at("type")
    }

    pub(super) fn material(&self, description: &MaterialDescription) -> Checked<Material> {
        let (reflection, normal_map, emission) = match description {
            MaterialDescription::Phong(phong) => {
                if let Some(color) = &phong.color {
                    self.color(color).at("color")?;
                }
                let reflection = Reflection::Phong {
                    ambient: self.factor(phong, &phong.ambient, "ambient")?,
                    diffuse: self.factor(phong, &phong.diffuse, "diffuse")?,
                    specular: self.factor(phong, &phong.specular, "specular")?,
                    shininess: between(phong.shininess, SHININESS).at("shininess")?,
                };
                (reflection, &phong.normal_map, &phong.emission)
            }
            MaterialDescription::Mirror(mirror) => {
                let tint = self.tint(&mirror.tint).at("tint")?;
                (Reflection::Mirror { tint }, &mirror.normal_map, &mirror.emission)
            }
            MaterialDescription::Glass(glass) => {
                let reflection = Reflection::Glass {
                    ior: ior(glass.ior).at("ior")?,
                    tint: self.tint(&glass.tint).at("tint")?,
                };
                (reflection, &glass.normal_map, &glass.emission)
            }
            MaterialDescription::Diffuse(diffuse) => {
                self.check_path_type("diffuse")?;
                let reflection = Reflection::Diffuse {
                    color: self.tint(&diffuse.color).at("color")?,
                    roughness: self.value(&diffuse.roughness).at("roughness")?,
                };
                (reflection, &diffuse.normal_map, &diffuse.emission)
            }
            MaterialDescription::Conductor(conductor) => {
                self.check_path_type("conductor")?;
                let white = ColorDescription::default();
                let reflection = Reflection::Conductor {
                    color: self.tint(conductor.color.as_ref().unwrap_or(&white)).at("color")?,
                    index: metal_index(conductor)?,
                    facets: self.facets(
                        &conductor.roughness,
                        conductor.anisotropy,
                        conductor.anisotropy_rotation,
                        conductor.energy_compensation,
                    )?,
                };
                (reflection, &conductor.normal_map, &conductor.emission)
            }
            MaterialDescription::Dielectric(dielectric) => {
                self.check_path_type("dielectric")?;
                let reflection = Reflection::Dielectric {
                    ior: ior(dielectric.ior).at("ior")?,
                    color: self.tint(&dielectric.color).at("color")?,
                    absorption: absorption(dielectric.absorption).at("absorption")?,
                    thin: dielectric.thin,
                    facets: self.facets(
                        &dielectric.roughness,
                        dielectric.anisotropy,
                        dielectric.anisotropy_rotation,
                        dielectric.energy_compensation,
                    )?,
                };
                check(!dielectric.thin || dielectric.absorption == DVec3::ZERO, || {
                    "must be 0 if thin is true: a thin sheet has no interior".to_owned()
                })
                .at("absorption")?;
                (reflection, &dielectric.normal_map, &dielectric.emission)
            }
            MaterialDescription::Principled(principled) => {
                self.check_path_type("principled")?;
                let reflection = Reflection::Principled(Box::new(self.principled(principled)?));
                (reflection, &principled.normal_map, &principled.emission)
            }
        };
        Ok(Material {
            reflection,
            emission: self.emission(emission).at("emission")?,
            normal_map: self.normal_map(normal_map).at("normal_map")?,
            visible: is_visible(description),
        })
    }

    fn facets(
        &self,
        roughness: &ValueDescription,
        anisotropy: f64,
        rotation: f64,
        compensated: bool,
    ) -> Checked<Facets> {
        Ok(Facets {
            roughness: self.value(roughness).at("roughness")?,
            anisotropy: between(anisotropy, FRACTIONS).at("anisotropy")?,
            rotation: between(rotation, ROTATIONS).at("anisotropy_rotation")?,
            compensated,
        })
    }

    fn factor(&self, phong: &PhongDescription, color: &Option<ColorDescription>, key: &str) -> Checked<Color> {
        let missing = || Problem::predicate(format!("is missing; set {key} or color"));
        let factor = color.as_ref().or(phong.color.as_ref()).ok_or_else(missing);
        factor.and_then(|factor| self.color(factor)).at(key)
    }
}

fn is_visible(description: &MaterialDescription) -> bool {
    let visible = match description {
        MaterialDescription::Phong(material) => material.visible,
        MaterialDescription::Mirror(material) => material.visible,
        MaterialDescription::Glass(material) => material.visible,
        MaterialDescription::Diffuse(material) => material.visible,
        MaterialDescription::Conductor(material) => material.visible,
        MaterialDescription::Dielectric(material) => material.visible,
        MaterialDescription::Principled(material) => material.visible,
    };
    visible.unwrap_or(true)
}

fn ior(ior: f64) -> Checked<f64> {
    between(ior, IORS)
}

fn absorption(absorption: DVec3) -> Checked<DVec3> {
    for x in absorption.to_array() {
        let (low, high) = ABSORPTIONS;
        check((low..=high).contains(&x), || {
            format!("{} must be from {} to {}", number(x), number(low), number(high))
        })?;
    }
    Ok(absorption)
}

/// Returns the complex index of refraction, if it is set. Only one of the keys `color`, `metal` and `eta` may be set.
fn metal_index(conductor: &ConductorDescription) -> Checked<Option<MetalIndex>> {
    let conflicting_key = |own_key: &str| {
        let keys = [
            ("color", conductor.color.is_some()),
            ("metal", conductor.metal.is_some()),
            ("eta", conductor.eta.is_some()),
        ];
        keys.into_iter()
            .find(|(key, is_set)| *is_set && *key != own_key)
            .map(|(key, _)| key)
    };
    if let Some(name) = &conductor.metal {
        check(conflicting_key("metal").is_none(), || {
            format!(
                "cannot be combined with {}",
                conflicting_key("metal").unwrap_or_default()
            )
        })
        .at("metal")?;
        let index = MetalIndex::named(name).ok_or_else(|| {
            let names: Vec<String> = MetalIndex::names().map(|name| format!("{name:?}")).collect();
            Problem::new(format!("{name:?} must be one of {}", names.join(", ")))
        });
        return index.at("metal").map(Some);
    }
    let (eta, k) = match (conductor.eta, conductor.k) {
        (None, None) => return Ok(None),
        (Some(eta), Some(k)) => (eta, k),
        (Some(_), None) => return Err(Problem::predicate("is missing; eta needs it")).at("k"),
        (None, Some(_)) => return Err(Problem::predicate("is missing; k needs it")).at("eta"),
    };
    check(conflicting_key("eta").is_none(), || {
        format!("cannot be combined with {}", conflicting_key("eta").unwrap_or_default())
    })
    .at("eta")?;
    for x in eta.to_array() {
        between(x, ETAS).at("eta")?;
    }
    for x in k.to_array() {
        between(x, KS).at("k")?;
    }
    Ok(Some(MetalIndex { eta, k }))
}
