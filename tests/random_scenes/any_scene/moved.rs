//! Scaling and translation of random scenes.

use glam::DVec3;
use wgray::scene::*;

/// Scales the cameras, lights and shapes of a scene about the origin, then translates them by `offset`.
pub fn scale_and_translate(description: &mut Description, scale: f64, offset: DVec3) {
    let move_point = |p: &mut DVec3| *p = *p * scale + offset;
    match &mut description.camera {
        CameraDescription::Perspective(c) => {
            for length in [&mut c.aperture, &mut c.focus_distance].into_iter().flatten() {
                *length *= scale;
            }
            [&mut c.position, &mut c.look_at].map(move_point)
        }
        CameraDescription::Panorama(c) => [&mut c.position, &mut c.look_at].map(move_point),
        CameraDescription::Orthographic(c) => {
            c.height *= scale;
            [&mut c.position, &mut c.look_at].map(move_point)
        }
    };
    for light in &mut description.lights {
        match light {
            LightDescription::Rectangle(l) => {
                move_point(&mut l.center);
                l.size = l.size.map(|side| side * scale);
            }
            LightDescription::Point(l) => move_point(&mut l.position),
            LightDescription::Spot(l) => move_point(&mut l.position),
            _ => {}
        }
    }
    for shape in &mut description.shapes {
        match shape {
            ShapeDescription::Rectangle(s) => {
                move_point(&mut s.center);
                s.size = s.size.map(|side| side * scale);
            }
            ShapeDescription::Sphere(s) => {
                move_point(&mut s.center);
                s.radius *= scale;
            }
            ShapeDescription::Disk(s) => {
                move_point(&mut s.center);
                s.radius *= scale;
            }
            ShapeDescription::Ellipsoid(s) => {
                move_point(&mut s.center);
                [&mut s.a, &mut s.b, &mut s.c]
                    .into_iter()
                    .for_each(|axis| *axis *= scale);
            }
            ShapeDescription::Cylinder(s) => {
                [&mut s.start, &mut s.end].into_iter().for_each(move_point);
                s.radius *= scale;
            }
            ShapeDescription::Triangle(s) => s.vertices.iter_mut().for_each(move_point),
            ShapeDescription::Tetrahedron(s) => s.vertices.iter_mut().for_each(move_point),
            ShapeDescription::Plane(s) => move_point(&mut s.point),
            ShapeDescription::Mesh(s) => move_placement(&mut s.translate, &mut s.scale, &mut s.matrix, scale, offset),
            other => panic!("no random scene has the shape {other:?}"),
        }
    }
    for i in &mut description.instances {
        move_placement(&mut i.translate, &mut i.scale, &mut i.matrix, scale, offset);
    }
}

fn move_placement(
    translate: &mut Option<DVec3>,
    factors: &mut Option<Scale>,
    matrix: &mut Option<Vec<[f64; 4]>>,
    scale: f64,
    offset: DVec3,
) {
    if let Some(rows) = matrix {
        for (row, offset) in rows.iter_mut().zip(offset.to_array()) {
            *row = row.map(|x| x * scale);
            row[3] += offset;
        }
        return;
    }
    *translate = Some(translate.unwrap_or_default() * scale + offset);
    *factors = Some(match factors {
        None => Scale::All(scale),
        Some(Scale::All(s)) => Scale::All(*s * scale),
        Some(Scale::Each(s)) => Scale::Each(*s * scale),
    });
}
