//! Proptest strategies: textures and materials.

use std::collections::BTreeMap;

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;
use wgray::scene::*;

use super::values::*;

pub fn color_or_texture() -> BoxedStrategy<ColorDescription> {
    let texture = select(&["checker", "lines", "constant"][..]).prop_map(str::to_string);
    prop_oneof![
        4 => color(1.0).prop_map(ColorDescription::Plain),
        1 => texture.prop_map(|texture| ColorDescription::Texture(TextureReference { texture })),
    ]
    .boxed()
}

pub fn textures() -> BoxedStrategy<BTreeMap<String, TextureDescription>> {
    let placement = (
        select(&[1.0, 4.0, 0.3, -2.0][..]),
        select(&[0.0, 30.0, 90.0][..]),
        0.0..1.0,
    );
    (color(1.0), color(1.0), placement, 0.05..0.5)
        .prop_map(|(even, odd, (scale, rotate, offset), line_width)| {
            let (scale, offset) = ([scale, scale * 2.0], [offset, 0.0]);
            let checker = CheckerDescription {
                even,
                odd,
                scale,
                rotate,
                offset,
            };
            let lines = LinesDescription {
                cell: even,
                line: odd,
                line_width,
                scale,
                rotate,
                offset,
            };
            BTreeMap::from([
                ("checker".to_string(), TextureDescription::Checker(checker)),
                ("lines".to_string(), TextureDescription::Lines(lines)),
                (
                    "constant".to_string(),
                    TextureDescription::Constant(ConstantDescription { color: even }),
                ),
            ])
        })
        .boxed()
}

pub fn material() -> BoxedStrategy<MaterialDescription> {
    let shininess =
        prop_oneof![3 => select(&[16.0, 1.0, 2.0, 50.0, 4096.0][..]), 1 => select(&[2.5, 0.5, 1e5, 1e-3][..])];
    let visible = prop_oneof![9 => Just(None), 1 => Just(Some(false))];
    let phong = (
        color_or_texture(),
        color_or_texture(),
        color_or_texture(),
        shininess,
        visible,
    )
        .prop_map(|(ambient, diffuse, specular, shininess, visible)| {
            MaterialDescription::Phong(PhongDescription {
                color: None,
                ambient: Some(ambient),
                diffuse: Some(diffuse),
                specular: Some(specular),
                shininess,
                normal_map: None,
                emission: None,
                visible,
            })
        });
    let mirror = color(1.0).prop_map(|tint| {
        let tint = ColorDescription::Plain(tint);
        MaterialDescription::Mirror(MirrorDescription {
            tint,
            normal_map: None,
            emission: None,
            visible: None,
        })
    });
    let glass = (color(1.0), select(&[1.5, 1.0, 0.7, 2.4][..])).prop_map(|(tint, ior)| {
        let tint = ColorDescription::Plain(tint);
        MaterialDescription::Glass(GlassDescription {
            ior,
            tint,
            normal_map: None,
            emission: None,
            visible: None,
        })
    });
    prop_oneof![6 => phong, 1 => mirror, 1 => glass].boxed()
}

/// Generates emission, or `None` in two of three cases.
pub fn emission() -> BoxedStrategy<Option<ColorDescription>> {
    let texture = select(&["checker", "lines", "constant"][..]).prop_map(str::to_string);
    prop_oneof![
        6 => Just(None),
        2 => color(5.0).prop_map(|color| Some(ColorDescription::Plain(color))),
        1 => texture.prop_map(|texture| Some(ColorDescription::Texture(TextureReference { texture }))),
    ]
    .boxed()
}

/// Generates a number from 0 to 1, often 0 or 1, or a texture channel.
pub fn fraction_or_texture() -> BoxedStrategy<ValueDescription> {
    let texture = (
        select(&["checker", "lines"][..]).prop_map(str::to_string),
        select(&[Channel::R, Channel::G, Channel::B][..]),
    );
    prop_oneof![
        3 => Just(ValueDescription::Plain(0.0)),
        2 => Just(ValueDescription::Plain(1.0)),
        3 => (0.0..=1.0).prop_map(ValueDescription::Plain),
        1 => texture.prop_map(|(texture, channel)| ValueDescription::channel(texture, channel)),
    ]
    .boxed()
}

/// Generates principled materials with any combination of lobes.
pub fn principled() -> BoxedStrategy<MaterialDescription> {
    let fractions = proptest::collection::vec(fraction_or_texture(), 8);
    let volume = (select(&[0.0, 1.0][..]), color(1.0), select(&[1.0, 1.3, 1.5, 2.4][..]));
    let alpha = (
        select(&[AlphaMode::Opaque, AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask][..]),
        fraction_or_texture(),
    );
    let vertex_settings = (
        select(&[VertexColors::None, VertexColors::BaseColor, VertexColors::Emission][..]),
        prop::bool::weighted(0.8),
    );
    (
        color_or_texture(),
        fractions,
        volume,
        alpha,
        (vertex_settings, -360.0..360.0),
    )
        .prop_map(
            |(
                base,
                fractions,
                (thickness, color, ior),
                (alpha_mode, alpha),
                (vertex_settings, anisotropy_rotation),
            )| {
                let mut fractions = fractions.into_iter();
                let mut next = || fractions.next().unwrap();
                let mut m = PrincipledDescription::default();
                (m.base_color, m.metallic, m.roughness) = (base, next(), next());
                (m.anisotropy, m.anisotropy_rotation) = (next(), anisotropy_rotation);
                (m.specular, m.transmission, m.ior) = (next(), next(), ior);
                if thickness > 0.0 {
                    (m.thickness, m.attenuation_color, m.attenuation_distance) = (thickness, color, Some(0.7));
                }
                (m.clearcoat, m.clearcoat_roughness, m.sheen_roughness) = (next(), next(), next());
                m.sheen_color = [0.0, 0.5, color.x].into();
                (m.alpha_mode, m.alpha) = (alpha_mode, alpha);
                (m.vertex_colors, m.double_sided) = vertex_settings;
                MaterialDescription::Principled(m)
            },
        )
        .boxed()
}

/// Generates any material that `path` supports.
pub fn path_material() -> BoxedStrategy<MaterialDescription> {
    let texture = select(&["checker", "lines"][..]).prop_map(str::to_string);
    let roughness = prop_oneof![
        2 => Just(ValueDescription::Plain(0.0)),
        1 => (0.0..=1.0).prop_map(ValueDescription::Plain),
        1 => texture.prop_map(ValueDescription::texture),
    ];
    let diffuse = (color_or_texture(), roughness.clone()).prop_map(|(color, roughness)| {
        let mut diffuse = DiffuseDescription::new(color);
        diffuse.roughness = roughness;
        MaterialDescription::Diffuse(diffuse)
    });
    let microfacets = (
        prop_oneof![1 => Just(ValueDescription::default()), 3 => roughness],
        prop_oneof![3 => Just(0.0), 1 => 0.0..=1.0],
        -360.0..=360.0,
        any::<bool>(),
    );
    let metal = prop_oneof![
        2 => color_or_texture().prop_map(ConductorDescription::new),
        1 => Just(ConductorDescription { metal: Some("gold".to_owned()), ..ConductorDescription::default() }),
        1 => (color(3.0), color(3.0)).prop_map(|(eta, k)| ConductorDescription {
            eta: Some(eta + 0.01),
            k: Some(k),
            ..ConductorDescription::default()
        }),
    ];
    let conductor = (metal, microfacets.clone()).prop_map(|(mut conductor, microfacets)| {
        (
            conductor.roughness,
            conductor.anisotropy,
            conductor.anisotropy_rotation,
            conductor.energy_compensation,
        ) = microfacets;
        MaterialDescription::Conductor(conductor)
    });
    let absorption = prop_oneof![Just(DVec3::ZERO), color(3.0)];
    let properties = (
        select(&[1.5, 1.0, 0.7, 2.4][..]),
        color_or_texture(),
        absorption,
        any::<bool>(),
    );
    let dielectric = (properties, microfacets).prop_map(|((ior, color, absorption, thin), microfacets)| {
        let mut dielectric = DielectricDescription::new(ior);
        (dielectric.color, dielectric.thin) = (color, thin);
        dielectric.absorption = if thin { DVec3::ZERO } else { absorption };
        (
            dielectric.roughness,
            dielectric.anisotropy,
            dielectric.anisotropy_rotation,
            dielectric.energy_compensation,
        ) = microfacets;
        MaterialDescription::Dielectric(dielectric)
    });
    let any = prop_oneof![4 => diffuse, 1 => conductor, 1 => dielectric, 2 => principled(), 3 => material()];
    (any, emission())
        .prop_map(|(mut material, emission)| {
            let target = match &mut material {
                MaterialDescription::Phong(m) => &mut m.emission,
                MaterialDescription::Mirror(m) => &mut m.emission,
                MaterialDescription::Glass(m) => &mut m.emission,
                MaterialDescription::Diffuse(m) => &mut m.emission,
                MaterialDescription::Conductor(m) => &mut m.emission,
                MaterialDescription::Dielectric(m) => &mut m.emission,
                MaterialDescription::Principled(m) => &mut m.emission,
                other => panic!("a material without emission: {other:?}"),
            };
            *target = emission;
            material
        })
        .boxed() // an unboxed strategy would put its value tree on the stack
}
