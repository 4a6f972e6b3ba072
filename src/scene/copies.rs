//! Simplifies any scene, or repeats it on a plane to reach large triangle counts.

use super::builder::{Look, SceneBuilder};
use super::builtin::numeric::sin_cos_turns;
use super::{Light, SceneData, SceneError, Transform};
use glam::{DVec3, Mat3, Quat, Vec3};
use raystone_core::geometry::{Camera, Triangle};
use raystone_core::random::Pcg32;
use std::collections::{HashMap, HashSet};

/// Triangle limit of a scene of copies: 36 bytes each, and as much in the reference tracer.
const MOST_TRIANGLES: usize = 100_000_000;
/// Spacing of the copies relative to touching, and their height above the plane.
const APART: f32 = 1.02;
const ABOVE: f32 = 1e-3;
/// Cells along the longest edge of the finest clustering grid.
const FINEST: u32 = 1 << 16;

/// Reduces the scene to at most `most` triangles (vertex clustering: J. Rossignac, P. Borrel,
/// "Multi-resolution 3D approximations for rendering complex scenes", 1993, using the mean of a
/// cell's vertices). Drops texture coordinates, normals and vertex colours. Returns the scene
/// unchanged if it is small enough already.
///
/// # Errors
/// [`SceneError::TooFew`] if no grid gives so few triangles.
pub(super) fn with_at_most(mut scene: SceneData, most: usize) -> Result<SceneData, SceneError> {
    if scene.triangles.len() <= most {
        return Ok(scene);
    }
    scene = scene.turned_outward();
    let (mut fits, mut too_fine) = (0, FINEST + 1);
    let mut kept = Vec::new();
    while too_fine - fits > 1 {
        let cells = fits.midpoint(too_fine);
        let found = clustered(&scene, cells);
        if found.len() <= most {
            (fits, kept) = (cells, found);
        } else {
            too_fine = cells;
        }
    }
    if kept.is_empty() {
        let (name, count) = (scene.name, scene.triangles.len());
        return Err(SceneError::TooFew { name, most, count });
    }
    let mut are_dark = false;
    for material in &mut scene.materials {
        // Better no light than light everywhere.
        if material.emission_texture.is_some() {
            (material.emission, are_dark) = (Vec3::ZERO, true);
        }
        // An alpha without an image needs no coordinates.
        material.mask = material.mask.filter(|mask| mask.texture.is_none());
        material.texture_uses_mut().for_each(|used| *used = None);
    }
    let of_vertices = !scene.normals.is_empty() || !scene.colors.is_empty();
    let lost = !scene.textures.is_empty() || of_vertices;
    let mut builder = SceneBuilder::new(false, kept.len());
    for (triangle, material) in kept {
        builder.push(triangle.vertices, material);
    }
    let count = scene.triangles.len();
    let camera = scene.camera;
    let (name, look) = taken_apart(scene, &mut builder, camera);
    let look = Look {
        textures: Vec::new(),
        ..look
    };
    let and_lost = match (lost, are_dark) {
        (_, true) => {
            ", without textures, the light of surfaces that one makes glow, and normals and colours of vertices"
        }
        (true, false) => ", without textures and normals and colours of vertices",
        (false, false) => "",
    };
    let note = format!(
        "{count} triangles were reduced to {} by merging vertices{and_lost}",
        builder.len()
    );
    builder.report.warnings.push(note);
    builder.finish(&name, look)
}

/// Triangles and materials that remain after merging the vertices of each cell.
fn clustered(scene: &SceneData, cells: u32) -> Vec<(Triangle, u32)> {
    let bounds = scene.bounds();
    let edge = (bounds.max - bounds.min).max_element() / cells as f32;
    let cell_of = |v: Vec3| {
        ((v - bounds.min) / edge)
            .floor()
            .as_uvec3()
            .min(glam::UVec3::splat(cells - 1))
    };
    let mut means: HashMap<glam::UVec3, (DVec3, f64)> = HashMap::new();
    for vertex in scene.triangles.iter().flat_map(|t| t.vertices) {
        let (sum, count) = means.entry(cell_of(vertex)).or_default();
        *sum += vertex.as_dvec3();
        *count += 1.0;
    }
    let mut known = HashSet::new();
    let mut kept = Vec::new();
    for (triangle, material) in scene.triangles.iter().zip(&scene.material_ids) {
        let corners = triangle.vertices.map(cell_of);
        let mut sorted = corners.map(|c| c.to_array());
        sorted.sort_unstable();
        let vertices = corners.map(|cell| {
            let (sum, count) = means[&cell];
            (sum / count).as_vec3()
        });
        let triangle = Triangle { vertices };
        let is_whole = sorted[0] != sorted[1] && sorted[1] != sorted[2];
        if is_whole && !triangle.has_zero_area() && known.insert(sorted) {
            kept.push((triangle, *material));
        }
    }
    kept
}

/// Places `copies` copies of a scene apart on a plane, with random turns, lights included. Drops vertex normals; media stay where they
/// are.
///
/// # Errors
/// [`SceneError::TooManyCopies`], or a transform error.
pub(super) fn on_a_plane(scene: SceneData, copies: usize) -> Result<SceneData, SceneError> {
    let count = scene.triangles.len();
    let needed = count.saturating_mul(copies);
    if needed > MOST_TRIANGLES {
        return Err(SceneError::TooManyCopies {
            name: scene.name,
            copies,
            needed,
            limit: MOST_TRIANGLES,
            most: MOST_TRIANGLES / copies,
        });
    }
    let scene = scene.turned_outward();
    let bounds = scene.bounds();
    let size = bounds.max - bounds.min;
    let height = size.y.max(0.01 * bounds.radius());
    let foot = Vec3::new(
        bounds.center().x,
        bounds.min.y - ABOVE * height,
        bounds.center().z,
    );
    let centred = |t: &Triangle| Triangle {
        vertices: t.vertices.map(|v| v - foot),
    };
    let model: Vec<Triangle> = scene.triangles.iter().map(centred).collect();
    let reach = (model.iter().flat_map(|t| t.vertices))
        .map(|v| v.x.hypot(v.z))
        .fold(0.0, f32::max);
    let spacing = 2.0 * APART * reach.max(0.1 * height);
    let row = (1..).find(|n| n * n >= copies).unwrap_or(1);
    let mut builder = SceneBuilder::new(!scene.uvs.is_empty(), needed + 2);
    if !scene.normals.is_empty() {
        let note = "copies are without the normals of vertices".to_owned();
        builder.report.warnings.push(note);
    }
    builder.add_object(model);
    builder.add_object(ground(0.5 * spacing * (row + 1) as f32));
    let (mut lights, near): (Vec<Light>, Vec<Light>) =
        (scene.lights.iter().cloned()).partition(Light::is_infinite);
    if !scene.media.is_empty() {
        let note = "media are not copied, and stay where they are".to_owned();
        builder.report.warnings.push(note);
    }
    let mut random = Pcg32::new(1001);
    for index in 0..copies {
        let (sin, cos) = sin_cos_turns(random.uniform());
        let (sin, cos) = (sin as f32, cos as f32);
        let turned = [Vec3::new(cos, 0.0, -sin), Vec3::Y, Vec3::new(sin, 0.0, cos)];
        let place = |k: usize| spacing * (k as f32 - 0.5 * (row - 1) as f32);
        let at = Vec3::new(place(index % row), 0.0, place(index / row));
        let turn = Quat::from_mat3(&Mat3::from_cols(turned[0], turned[1], turned[2]));
        let moved = |light: &Light| light.clone().moved(turn, at - turn * foot);
        lights.extend(near.iter().map(moved));
        let to_world = Transform::new(turned, at);
        let material = |triangle: usize| scene.material_ids[triangle];
        builder.place_looking(0, to_world, material, &scene.uvs, &scene.colors);
    }
    let plane = scene.materials.len() as u32;
    builder.place(1, Transform::IDENTITY, plane);
    // From above one corner, looking over all copies.
    let far = spacing * row as f32;
    let eye = Vec3::new(0.35 * far, 0.35 * far + height, 0.75 * far + spacing);
    let camera = Camera::upright(eye, Vec3::new(0.0, 0.3 * height, 0.1 * far), 45.0);
    let (name, mut look) = taken_apart(scene, &mut builder, Some(camera));
    look.lights = lights;
    look.materials
        .push(super::Material::diffuse("plane", Vec3::splat(0.5)));
    builder.finish(&name, look)
}

/// A square of two triangles around the origin, facing up.
fn ground(half: f32) -> Vec<Triangle> {
    let [a, b, c, d] = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)]
        .map(|(x, z)| half * Vec3::new(x, 0.0, z));
    vec![
        Triangle {
            vertices: [a, b, c],
        },
        Triangle {
            vertices: [a, c, d],
        },
    ]
}

/// Moves everything but the triangles into a new scene, and rebuilds the default sky.
fn taken_apart(
    scene: SceneData,
    builder: &mut SceneBuilder,
    camera: Option<Camera>,
) -> (String, Look) {
    let sky = scene.daylight.as_ref().map(|sky| sky.note());
    let said = scene.report.warnings.into_iter();
    let said = said.filter(|line| Some(line) != sky.as_ref());
    builder.report.warnings.splice(0..0, said);
    builder.report.dropped_non_finite += scene.report.dropped_non_finite;
    let look = Look {
        materials: scene.materials,
        textures: scene.textures,
        camera,
        environment: if sky.is_some() {
            Vec3::ZERO
        } else {
            scene.environment
        },
        lights: scene.lights,
        media: scene.media,
    };
    (scene.name, look)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::tests::{load_default, load_unlit, load_with};
    use crate::{Bounds, load, named};
    use glam::Vec2;
    use raystone_core::params::ParamValue;

    fn changed(name: &str, changes: &[(&str, i64)]) -> SceneData {
        let changes: Vec<_> = (changes.iter())
            .map(|(key, value)| (*key, ParamValue::Integer(*value)))
            .collect();
        load_with(name, &changes)
    }

    #[test]
    fn copies_stand_apart_on_the_plane_and_are_the_model_turned() {
        let plain = load_default("displaced-sphere");
        let scene = changed("displaced-sphere", &[("copies", 11)]);
        let assembly = scene.assembly.as_ref().expect("instances");
        assert_eq!(
            (assembly.objects().len(), assembly.instances().len()),
            (2, 12)
        );
        assert_eq!(scene.triangles.len(), 11 * plain.triangles.len() + 2);
        let bounds = |i: &crate::Instance| Bounds::of(&assembly.copy(i).collect::<Vec<_>>());
        let boxes: Vec<Bounds> = assembly.instances()[..11].iter().map(bounds).collect();
        for (i, a) in boxes.iter().enumerate() {
            assert!(a.min.y > 0.0 && a.min.y < 0.01 * (a.max.y - a.min.y));
            for b in &boxes[i + 1..] {
                let meet = a.min.max(b.min).cmple(a.max.min(b.max)).all();
                assert!(!meet, "{a:?} {b:?}");
            }
        }
        let edges = |t: &Triangle| {
            let [a, b, c] = t.vertices;
            [a.distance(b), b.distance(c), c.distance(a)]
        };
        for (copy, own) in scene
            .triangles
            .iter()
            .zip(plain.triangles.iter().cycle())
            .take(boxes.len() * plain.triangles.len())
        {
            for (x, y) in edges(copy).into_iter().zip(edges(own)) {
                assert!((x - y).abs() < 1e-4, "{x} {y}");
            }
        }
        assert_eq!(
            scene.material_ids[..plain.triangles.len()],
            plain.material_ids[..]
        );
        assert_eq!(
            *scene.material_ids.last().unwrap() as usize,
            plain.materials.len()
        );
    }

    #[test]
    fn fewer_triangles_keep_the_shape() {
        let plain = load_default("displaced-sphere");
        let scene = changed("displaced-sphere", &[("most_triangles", 500)]);
        assert!(
            (200..=500).contains(&scene.triangles.len()),
            "{}",
            scene.triangles.len()
        );
        let (a, b) = (plain.bounds(), scene.bounds());
        assert!(a.min.distance(b.min).max(a.max.distance(b.max)) < 0.15 * a.radius());
        assert!(
            scene.report.warnings[0].contains("reduced to"),
            "{:?}",
            scene.report
        );
        let area = |s: &SceneData| s.triangles.iter().map(area).sum::<f32>();
        assert!((0.8..1.1).contains(&(area(&scene) / area(&plain))));
        let all = changed("displaced-sphere", &[("most_triangles", 1 << 30)]);
        assert_eq!(all.hash, plain.hash);
    }

    fn area(t: &Triangle) -> f32 {
        let [a, b, c] = t.vertices;
        0.5 * (b - a).cross(c - a).length()
    }

    #[test]
    fn what_cannot_be_had_is_refused_with_what_to_do() {
        let entry = crate::builtin_scenes()
            .into_iter()
            .find(|e| e.name == "city")
            .unwrap();
        let mut variant = entry.default_variant();
        let mut with = |key: &str, value: i64| {
            variant
                .params
                .0
                .insert(key.to_owned(), ParamValue::Integer(value));
            load(&variant, &Default::default()).unwrap_err().to_string()
        };
        let many = with("copies", 4096);
        assert!(many.contains("most_triangles = 24414"), "{many}");
        let none = with("most_triangles", 1);
        assert!(
            none.contains("leaves none of 59688 triangles; raise it"),
            "{none}"
        );
        assert!(named("city").is_ok());
    }

    #[test]
    fn a_scene_without_a_light_has_one_sky_however_often_it_is_built_again() {
        let scene = load_unlit(&[("copies", ParamValue::Integer(3))]);
        assert!(scene.daylight.is_some());
        assert_eq!(scene.report.warnings.len(), 1, "{:?}", scene.report);
        assert_eq!(scene.environment, Vec3::ONE);
    }

    #[test]
    fn lights_go_with_their_copies() {
        let mut scene = load_default("triangle-soup");
        let height = 2.0;
        let at = scene.triangles[7].vertices[1];
        scene.lights = vec![
            Light::Point {
                position: at + height * Vec3::Y,
                intensity: Vec3::ONE,
            },
            Light::Directional {
                direction: -Vec3::Y,
                irradiance: Vec3::ONE,
            },
        ];
        let count = scene.triangles.len();
        let placed = on_a_plane(scene, 3).unwrap();
        let points: Vec<Vec3> = (placed.lights.iter())
            .filter_map(|light| match light {
                Light::Point { position, .. } => Some(*position),
                _ => None,
            })
            .collect();
        assert_eq!((points.len(), placed.lights.len()), (3, 4));
        for (copy, light) in points.into_iter().enumerate() {
            let below = placed.triangles[copy * count + 7].vertices[1];
            let off = light - (below + height * Vec3::Y);
            assert!(off.length() < 1e-4, "{copy}: {off}");
        }
    }

    #[test]
    fn fewer_triangles_keep_an_alpha_without_an_image_and_no_light_that_had_one() {
        let mut scene = load_default("displaced-sphere");
        let material = &mut scene.materials[0];
        material.emission = Vec3::ONE;
        material.mask = Some(crate::AlphaMask::even(0.3));
        let few = with_at_most(scene.clone(), 500).unwrap();
        assert_eq!(few.materials[0].mask, scene.materials[0].mask);
        assert_eq!(few.materials[0].emission, Vec3::ONE);
        scene.materials[0].emission_texture = Some(crate::TextureUse::plain(0));
        let few = with_at_most(scene, 500).unwrap();
        assert_eq!(few.materials[0].emission, Vec3::ZERO);
        assert!(few.report.warnings[0].contains("the light of"));
    }

    #[test]
    fn copies_of_a_textured_scene_keep_its_coordinates() {
        let mut scene = load_default("triangle-soup");
        scene.uvs = (0..scene.triangles.len())
            .map(|i| [Vec2::splat(i as f32); 3])
            .collect();
        scene.textures.push(crate::Texture {
            name: "t".to_owned(),
            width: 1,
            height: 1,
            texels: vec![[255; 4]],
        });
        let uvs = scene.uvs.clone();
        let placed = on_a_plane(scene, 2).unwrap();
        assert_eq!(placed.uvs[..uvs.len()], uvs[..]);
        assert_eq!(placed.uvs[uvs.len()..][..uvs.len()], uvs[..]);
    }
}
