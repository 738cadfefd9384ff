// Scattering at a surface for all material kinds.

struct Reflection {
    value: vec3f,          // BSDF times |cos| of the angle between wi and the shading normal
    pdf: f32,              // per solid angle
}

// Evaluates materials that need no local frame.
fn plain_reflection(surface: Surface, material: Material, wi: vec3f) -> Reflection {
    let angles = angles_at(surface.shading_normal, surface.wo, wi);
    var result = Reflection(vec3f(0.0), 0.0);
    if (MATERIALS & (1u << DIFFUSE)) != 0u {
        result = Reflection(diffuse_eval(material, angles), diffuse_pdf(angles));
        if ROUGH != 0u {
            if material.roughness > 0.0 {
                result.value = rough_diffuse_eval(material, angles);
            }
        }
    }
    if (MATERIALS & (1u << PHONG)) != 0u {
        if material.kind == PHONG {
            result = Reflection(modified_phong_eval(material, angles), modified_phong_pdf(material, angles));
        }
    }
    return result;
}

// Evaluates the material. The value is 0 if `direction_allowed` returns false for wi.
fn reflection(prim: HitPrimitive, surface: Surface, material: Material, mixture: PrincipledLobes, wi: vec3f) -> Reflection {
    var result = plain_reflection(surface, material, wi);
    if (MATERIALS & MICROFACET_KINDS) != 0u {
        if has_facets(material) {
            let frame = Tangents(surface.du, surface.dv);
            let wo = vector_to_lobe(frame, surface.shading_normal, surface.wo);
            result = facet_reflection(material, wo, vector_to_lobe(frame, surface.shading_normal, wi));
        }
    }
    if (MATERIALS & (1u << PRINCIPLED)) != 0u {
        if material.kind == PRINCIPLED {
            let local = vector_to_lobe(Tangents(surface.du, surface.dv), surface.shading_normal, wi);
            let wo = local_wo(surface);
            result = Reflection(principled_eval(mixture, wo, local, LOBES), principled_pdf(mixture, wo, local, LOBES));
        }
    }
    result.value = select(vec3f(0.0), result.value, direction_allowed(prim, surface, material, wi));
    return result;
}

// Clamps the parameters of textured or vertex-colored materials, so that the materials create no energy.
fn bounded(original: Material) -> Material {
    var material = original;
    if (LOOKUPS != 0u) | (VERTEX_COLORS != 0u) {
        let one = vec3f(1.0);
        let exceeds = (original.diffuse > one) & vec3<bool>((original.kind == DIFFUSE) | (original.kind == PRINCIPLED));
        material.diffuse = select(original.diffuse, one, exceeds);
        material.tint = select(original.tint, one, original.tint > one);
        material.roughness = min(original.roughness, 1.0);
        if (MATERIALS & (1u << PRINCIPLED)) != 0u {
            material.sheen = select(original.sheen, one, original.sheen > one);
            material.sheen_roughness = min(original.sheen_roughness, 1.0);
            material.anisotropy = min(original.anisotropy, 1.0);
            material.metallic = min(original.metallic, 1.0);
            material.transmission = min(original.transmission, 1.0);
            material.clearcoat = min(original.clearcoat, 1.0);
            material.clearcoat_roughness = min(original.clearcoat_roughness, 1.0);
            material.specular_weight = min(original.specular_weight, 1.0);
        }
    }
    return material;
}

// Returns `normal`, from a normal map, if the material can use this normal, else a usable normal.
fn shaded_normal(surface: Surface, material: Material, normal: vec3f) -> vec3f {
    if is_delta(material) {
        let usable = usable_normal(surface, normal);
        let refracts = (material.kind == GLASS) | (material.kind == ROUGH_GLASS);
        return select(usable, surface.normal, refracts & !refracts_inwards(surface, material, usable));
    }
    if (MATERIALS & (MICROFACET_KINDS | (1u << PRINCIPLED))) != 0u {
        if has_facets(material) | (material.kind == PRINCIPLED) {
            return usable_normal(surface, normal);
        }
    }
    return normal;
}

// Returns the approximate albedo.
fn albedo(material: Material) -> vec3f {
    if material.kind == PHONG {
        let factors = phong_factors(material);
        return factors.diffuse + factors.specular;
    }
    if (MATERIALS & MICROFACET_KINDS) != 0u {
        if has_facets(material) {
            return select(material.tint, metal_fresnel(material, 1.0), material.kind == METAL);
        }
    }
    return select(vec3f(0.0), material.diffuse, (material.kind == DIFFUSE) | (material.kind == PRINCIPLED));
}

fn has_inside(material: Material) -> bool {
    let is_volume = (material.kind == PRINCIPLED) & (material.thin == 0u) & (material.transmission > 0.0);
    return (material.kind == GLASS) | (material.kind == ROUGH_GLASS) | is_volume;
}

// Returns true if the material scatters only specularly.
fn is_delta(material: Material) -> bool {
    if (DELTA_KINDS & MICROFACET_KINDS) != 0u {
        return is_specular(material) | (has_facets(material) & is_polished(material));
    }
    return is_specular(material);
}

// Returns true for microfacet materials, polished or not.
fn has_facets(material: Material) -> bool {
    return ((MICROFACET_KINDS >> material.kind) & 1u) != 0u;
}

fn facet_frame(surface: Surface, material: Material) -> Tangents {
    if ANISOTROPIC != 0u {
        return lobe_frame(surface, material.rotation);
    }
    return frame_around(surface.shading_normal);
}

// Returns a microfacet material with fields for the viewer's direction: `ior` of rough glass is the index behind the
// surface relative to the index on the viewer's side, `loss` is the energy that single scattering loses relative to the
// single-scattering albedo. `surface.du` and `surface.dv` are the axes of the frame.
fn material_for_view(surface: Surface, original: Material) -> Material {
    var material = original;
    let wo = vector_to_lobe(Tangents(surface.du, surface.dv), surface.shading_normal, surface.wo);
    if (MATERIALS & (1u << ROUGH_GLASS)) != 0u {
        if material.kind == ROUGH_GLASS {
            material.ior = 1.0 / eta_of(surface, original);
        }
    }
    if material.energy != NO_INDEX {
        material.loss = facet_loss(facet_alpha(material), wo);
        if (MATERIALS & (1u << ROUGH_GLASS)) != 0u {
            if material.kind == ROUGH_GLASS {
                material.loss = 1.0 / single_scatter_albedo_glass(material, facet_alpha(material), wo, surface.side) - 1.0;
            }
        }
        if ANISOTROPIC != 0u {
            if (material.aniso_table != 0u) & (material.kind != ROUGH_GLASS) {
                material.loss = 1.0 / single_scatter_albedo_aniso(material, facet_alpha(material), wo, 0u) - 1.0;
            }
        }
    }
    return material;
}

// Evaluates a microfacet material. `wo` and `wi` are in the frame of the shading normal.
fn facet_reflection(material: Material, wo: vec3f, wi: vec3f) -> Reflection {
    var result = Reflection(vec3f(0.0), 0.0);
    if (MATERIALS & (1u << METAL)) != 0u {
        if material.kind == METAL {
            result = Reflection(metal_eval(material, wo, wi), metal_pdf(material, wo, wi));
        }
    }
    if (MATERIALS & (1u << ROUGH_GLASS)) != 0u {
        if material.kind == ROUGH_GLASS {
            result = Reflection(rough_dielectric_eval(material, wo, wi), rough_dielectric_pdf(material, wo, wi));
        }
    }
    if (MATERIALS & (1u << THIN)) != 0u {
        if material.kind == THIN {
            result = Reflection(thin_eval(material, wo, wi), thin_pdf(material, wo, wi));
        }
    }
    return result;
}

// Samples a microfacet material in its frame.
fn facet_sample(material: Material, wo: vec3f, u: vec2f, random: f32) -> LobeSample {
    var result = LobeSample(vec3f(0.0, 0.0, 1.0), vec3f(0.0), 0.0, 1.0);
    if (MATERIALS & (1u << METAL)) != 0u {
        if material.kind == METAL {
            result = metal_sample(material, wo, u);
        }
    }
    if (MATERIALS & (1u << ROUGH_GLASS)) != 0u {
        if material.kind == ROUGH_GLASS {
            result = rough_dielectric_sample(material, wo, u, random);
        }
    }
    if (MATERIALS & (1u << THIN)) != 0u {
        if material.kind == THIN {
            result = thin_sample(material, wo, u, random);
        }
    }
    return result;
}

// Returns wo in the frame of du and dv, above the surface.
fn local_wo(surface: Surface) -> vec3f {
    let wo = vector_to_lobe(Tangents(surface.du, surface.dv), surface.shading_normal, surface.wo);
    return vec3f(wo.x, wo.y, max(wo.z, 1e-6));
}

fn mixture_at(surface: Surface, material: Material, coat_normal: vec3f) -> PrincipledLobes {
    var coat = vec3f(0.0, 0.0, 1.0);
    if ((LOBES & LOBE_COAT) != 0u) & (NORMAL_MAPS == 1u) {
        coat = vector_to_lobe(Tangents(surface.du, surface.dv), surface.shading_normal, usable_normal(surface, coat_normal));
    }
    let wo = local_wo(surface);
    let energy = principled_energy(material, wo, surface.side);
    return principled_mixture(material, wo, surface.side > 0.0, coat, LOBES, energy);
}

// Returns true if wi is in front of the surface for the shading normal and the smooth normal, and the triangle itself
// does not occlude wi; for transmissive materials, also if wi is behind the surface for all normals.
fn direction_allowed(prim: HitPrimitive, surface: Surface, material: Material, wi: vec3f) -> bool {
    var lit = is_lit(surface, wi);
    if (TLAS_KINDS & (1u << INSTANCE)) != 0u {
        lit &= face_direction_allowed(prim, surface, wi);
    }
    if ((MATERIALS & TRANSMISSIVE_KINDS) != 0u) | ((LOBES & LOBE_TRANSMISSION) != 0u) {
        let behind = (dot(surface.shading_normal, wi) < 0.0) & (dot(surface.smooth_normal, wi) < 0.0);
        lit |= is_transmissive(material) & behind & (dot(surface.normal, wi) < 0.0);
    }
    return lit;
}

// Returns true if the material transmits light other than by a delta BSDF.
fn is_transmissive(material: Material) -> bool {
    var transmits = ((TRANSMISSIVE_KINDS >> material.kind) & 1u) != 0u;
    if (LOBES & LOBE_TRANSMISSION) != 0u {
        transmits |= (material.kind == PRINCIPLED) & (material.transmission > 0.0);
    }
    return transmits;
}

// Returns the shading normal, or 0 if light may arrive from both sides.
fn lit_normal(surface: Surface, material: Material) -> vec3f {
    return select(surface.shading_normal, vec3f(0.0), is_transmissive(material));
}

// Returns the surface with its sides exchanged, for rays that leave on the side away from the viewer.
fn flipped(surface: Surface) -> Surface {
    var result = surface;
    result.ray_origin = surface.position - (surface.ray_origin - surface.position);
    if (TLAS_KINDS & (1u << INSTANCE)) != 0u {
        result.ray_origin += surface.terminator_offset;
    }
    result.exclude_front = surface.exclude_back;
    result.exclude_back = surface.exclude_front;
    return result;
}

// Returns the absorption behind a surface; `before` is the absorption on the viewer's side.
fn absorption_after(before: vec3f, surface: Surface, material: Material) -> vec3f {
    return select(before, select(vec3f(0.0), material.absorption, surface.side > 0.0), has_inside(material));
}
