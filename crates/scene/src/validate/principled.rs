//! Validation of the material `principled`.

use glam::DVec3;

use super::super::limits::{ABSORPTIONS, ATTENUATION_DISTANCES, FRACTIONS, PRINCIPLED_IORS, ROTATIONS, THICKNESSES};
use super::super::{AlphaMode, Color, Principled, PrincipledDescription, Value, VertexColors};
use super::texture::Textures;
use super::{At, Checked, Problem, between, check};

impl Textures<'_> {
    pub(super) fn principled(&self, description: &PrincipledDescription) -> Checked<Principled> {
        let thin = description.thickness == 0.0;
        between(description.thickness, THICKNESSES).at("thickness")?;
        let absorption = absorption(description.attenuation_color, description.attenuation_distance)?;
        check(!thin || absorption == DVec3::ZERO, || {
            "needs a thickness: a thin surface has no interior that absorbs light".to_owned()
        })
        .at("attenuation_color")?;
        Ok(Principled {
            base_color: self.tint(&description.base_color).at("base_color")?,
            metallic: self.value(&description.metallic).at("metallic")?,
            roughness: self.value(&description.roughness).at("roughness")?,
            anisotropy: self.value(&description.anisotropy).at("anisotropy")?,
            anisotropy_rotation: between(description.anisotropy_rotation, ROTATIONS)
                .at("anisotropy_rotation")?
                .to_radians(),
            anisotropy_direction: self
                .direction(&description.anisotropy_direction)
                .at("texture")
                .at("anisotropy_direction")?,
            ior: between(description.ior, PRINCIPLED_IORS).at("ior")?,
            specular: self.value(&description.specular).at("specular")?,
            specular_color: self.color(&description.specular_color).at("specular_color")?,
            transmission: self.value(&description.transmission).at("transmission")?,
            thin,
            absorption,
            clearcoat: self.value(&description.clearcoat).at("clearcoat")?,
            clearcoat_roughness: self.value(&description.clearcoat_roughness).at("clearcoat_roughness")?,
            clearcoat_normal_map: self
                .normal_map(&description.clearcoat_normal_map)
                .at("clearcoat_normal_map")?,
            sheen_color: self.tint(&description.sheen_color).at("sheen_color")?,
            sheen_roughness: self.value(&description.sheen_roughness).at("sheen_roughness")?,
            alpha: self.value(&description.alpha).at("alpha")?,
            alpha_mode: description.alpha_mode,
            alpha_cutoff: between(description.alpha_cutoff, FRACTIONS).at("alpha_cutoff")?,
            vertex_colors: description.vertex_colors,
            double_sided: description.double_sided,
        })
    }
}

/// Returns a dielectric with this base color and roughness, and with defaults for all other values.
pub(super) fn dielectric(base_color: Color, roughness: f64) -> Principled {
    Principled {
        base_color,
        metallic: Value::Plain(0.0),
        roughness: Value::Plain(roughness),
        anisotropy: Value::Plain(0.0),
        anisotropy_rotation: 0.0,
        anisotropy_direction: None,
        ior: 1.5,
        specular: Value::Plain(1.0),
        specular_color: Color::Plain(DVec3::ONE),
        transmission: Value::Plain(0.0),
        thin: true,
        absorption: DVec3::ZERO,
        clearcoat: Value::Plain(0.0),
        clearcoat_roughness: Value::Plain(0.0),
        clearcoat_normal_map: None,
        sheen_color: Color::BLACK,
        sheen_roughness: Value::Plain(0.0),
        alpha: Value::Plain(1.0),
        alpha_mode: AlphaMode::Opaque,
        alpha_cutoff: 0.5,
        vertex_colors: VertexColors::None,
        double_sided: true,
    }
}

/// Returns the absorption coefficient per unit of length that gives the transmittance `color` over a distance.
fn absorption(color: DVec3, distance: Option<f64>) -> Checked<DVec3> {
    for x in color.to_array() {
        between(x, FRACTIONS).at("attenuation_color")?;
    }
    let Some(distance) = distance else {
        return match color == DVec3::ONE {
            true => Ok(DVec3::ZERO),
            false => Err(Problem::predicate("is missing; attenuation_color needs it").at("attenuation_distance")),
        };
    };
    let distance = between(distance, ATTENUATION_DISTANCES).at("attenuation_distance")?;
    Ok(color.map(|x| (-x.ln() / distance).clamp(ABSORPTIONS.0, ABSORPTIONS.1)))
}
