//! Pictures that show nothing, such as a black one, and the likely reason.

use glam::Vec3;
use raystone_accel::{NO_HIT, TriangleSoup, brute_force_hits};
use raystone_core::geometry::Camera;
use raystone_image::Image;
use raystone_scene::{LightList, ListedLight, SceneData, Source};
use raystone_verify::rays::primary_rays;
use std::borrow::Borrow;

/// Camera rays per side of the picture that look for the reason.
const GRID: u32 = 16;

/// Linear radiance that a screen shows as black: less than one step of 255 in sRGB.
const SHOWN_AS_BLACK: f32 = 3e-4;
/// Share of pixels from which a picture counts as nearly black.
const NEARLY_ALL: f64 = 0.98;

/// What to say of a picture that has the same value in every pixel, or is nearly black, with the likely reason; `None`
/// for others. Only then are the `triangles` asked for.
pub(super) fn remark<S: Borrow<TriangleSoup>>(
    image: &Image,
    scene: &SceneData,
    triangles: impl FnOnce() -> S,
    camera: Camera,
) -> Option<String> {
    let first = image.pixels.first()?;
    if image.pixels.iter().any(|pixel| pixel != first) {
        let dark = |pixel: &&[f32; 3]| pixel.iter().all(|c| *c < SHOWN_AS_BLACK);
        let dark = image.pixels.iter().filter(dark).count();
        let share = dark as f64 / image.pixels.len() as f64;
        return (share >= NEARLY_ALL).then(|| {
            let sight = Sight::new(scene, triangles().borrow(), camera);
            format!(
                "{:.1} % of the pixels are black on a screen: {}",
                100.0 * share,
                sight.why_dim(scene)
            )
        });
    }
    let sight = Sight::new(scene, triangles().borrow(), camera);
    let [what, reason] = if *first == [0.0; 3] {
        ["is black", &sight.why_black(scene)]
    } else {
        ["has the same value", &sight.why_uniform(scene)]
    };
    Some(format!("every pixel {what}: {reason}"))
}

/// What the camera sees through a grid of rays.
struct Sight {
    camera: Camera,
    /// Number of rays.
    rays: usize,
    /// The triangles that they hit, one per ray.
    triangles: Vec<usize>,
    /// Number of hits from behind.
    from_behind: usize,
    /// Distance to the nearest hit, units of the scene.
    nearest: f32,
}

impl Sight {
    fn new(scene: &SceneData, soup: &TriangleSoup, camera: Camera) -> Self {
        let rays = primary_rays(camera, GRID, GRID);
        let mut sight = Self {
            camera,
            rays: rays.len(),
            triangles: Vec::new(),
            from_behind: 0,
            nearest: f32::INFINITY,
        };
        for (ray, hit) in rays.iter().zip(brute_force_hits(soup, &rays)) {
            if hit.triangle == NO_HIT {
                continue;
            }
            let triangle = hit.triangle as usize;
            let [a, b, c] = scene.outward(triangle);
            let normal = (b - a).cross(c - a);
            sight.from_behind += usize::from(normal.dot(Vec3::from(ray.direction)) > 0.0);
            sight.nearest = sight.nearest.min(hit.t);
            sight.triangles.push(triangle);
        }
        sight
    }

    /// Why nothing but one surface, or none, is seen; `None` if the camera sees several.
    fn why_nothing(&self, scene: &SceneData) -> Option<String> {
        let eye = self.camera.eye;
        if self.triangles.is_empty() {
            let bounds = scene.bounds();
            return Some(format!(
                "the camera at {eye} looks past the scene, which reaches from {} to {}; set \
                 camera.eye and camera.target",
                bounds.min, bounds.max
            ));
        }
        (self.from_behind == self.rays).then(|| {
            format!(
                "the camera at {eye} is inside or behind a surface: all that it sees are back \
                 faces, the nearest at a distance of {}; set camera.eye and camera.target",
                self.nearest
            )
        })
    }

    fn why_black(&self, scene: &SceneData) -> String {
        let lights = LightList::of(scene).lights;
        let is_dark = |light: &ListedLight| dark_texture(scene, light).is_some();
        if lights.is_empty() && scene.environment == Vec3::ZERO {
            return "the scene has no light: no lamp, no emissive material, no sky; give it one, \
                    such as an environment map (scene.NAME.environment)"
                .to_owned();
        }
        if scene.environment == Vec3::ZERO && !lights.is_empty() && lights.iter().all(is_dark) {
            let name = lights.first().and_then(|light| dark_texture(scene, light));
            return format!(
                "no light reached it: all that shines are emissive textures, and `{}` is black",
                name.unwrap_or_default()
            );
        }
        self.why_nothing(scene).unwrap_or_else(|| {
            "no light reached it: what the camera sees is shut off from all lamps and from the \
             sky, faces away from them, or reflects nothing"
                .to_owned()
        })
    }

    fn why_dim(&self, scene: &SceneData) -> String {
        let missed = 1.0 - self.triangles.len() as f64 / self.rays.max(1) as f64;
        if scene.environment == Vec3::ZERO && missed > NEARLY_ALL * 0.9 {
            return format!(
                "{:.0} % of what the camera sees is a black sky; move it nearer, or give the scene an environment",
                100.0 * missed
            );
        }
        let lights = LightList::of(scene).lights;
        let emissive = |light: &ListedLight| matches!(light.source, Source::Triangle(_));
        if scene.environment == Vec3::ZERO && lights.iter().all(emissive) {
            format!(
                "all that shines are {} emissive triangles, which light little of what the camera sees; give the scene a lamp or an environment",
                lights.len()
            )
        } else {
            "its lights reach little of what the camera sees, or are weak beside the size of the scene".to_owned()
        }
    }

    fn why_uniform(&self, scene: &SceneData) -> String {
        self.why_nothing(scene).unwrap_or_else(|| {
            let id = self
                .triangles
                .first()
                .and_then(|t| scene.material_ids.get(*t));
            let material = id.and_then(|id| scene.materials.get(*id as usize));
            let name = material.map_or("", |material| &material.name);
            format!("all that the camera sees looks alike (material `{name}`)")
        })
    }
}

/// The name of a lamp's emissive texture, if its texels are all black.
fn dark_texture<'a>(scene: &'a SceneData, light: &ListedLight) -> Option<&'a str> {
    let triangle = match light.source {
        Source::Triangle(triangle) => triangle,
        _ => return None,
    };
    let id = *scene.material_ids.get(triangle as usize)?;
    let used = scene
        .materials
        .get(id as usize)?
        .emission_texture
        .as_ref()?;
    let texture = scene.textures.get(used.texture as usize)?;
    let is_black = |texel: &[u8; 4]| texel[..3] == [0; 3];
    texture
        .texels
        .iter()
        .all(is_black)
        .then_some(&*texture.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_scene::{Texture, TextureUse, named};

    fn remark_on(color: [f32; 3], scene: &SceneData, camera: Camera) -> Option<String> {
        let image = Image::new(4, 4, vec![color; 16]).unwrap();
        remark(&image, scene, || TriangleSoup::new(scene), camera)
    }

    #[test]
    fn a_picture_of_one_value_names_the_likely_reason() {
        let mut scene = named("cornell-box").unwrap();
        let camera = scene.view(1.0);
        let black = |scene: &SceneData, camera| remark_on([0.0; 3], scene, camera).unwrap();
        let says = |text: String, part: &str| assert!(text.contains(part), "{text}");
        says(black(&scene, camera), "shut off from all lamps");
        let away = Camera {
            target: camera.eye * 2.0 - camera.target,
            ..camera
        };
        says(black(&scene, away), "looks past the scene, which reaches");
        let gray = remark_on([0.5; 3], &scene, camera).unwrap();
        assert!(
            gray.starts_with("every pixel has the same value: all that"),
            "{gray}"
        );
        scene.textures.push(Texture {
            name: "glow.png".to_owned(),
            width: 1,
            height: 1,
            texels: vec![[0, 0, 0, 255]],
        });
        let texture = scene.textures.len() as u32 - 1;
        for material in &mut scene.materials {
            material.emission_texture = Some(TextureUse::plain(texture));
        }
        says(black(&scene, camera), "`glow.png` is black");
        for material in &mut scene.materials {
            material.emission = Vec3::ZERO;
        }
        says(black(&scene, camera), "the scene has no light");
        let sphere = named("displaced-sphere").unwrap();
        let bounds = sphere.bounds();
        let middle = 0.5 * (bounds.min + bounds.max);
        let within = Camera::upright(middle, middle + Vec3::X, 40.0);
        says(black(&sphere, within), "inside or behind a surface");
    }

    #[test]
    fn a_picture_with_a_few_bright_pixels_says_what_shines() {
        let scene = named("cornell-box").unwrap();
        let mut pixels = vec![[1e-5; 3]; 100];
        pixels[7] = [3.0; 3];
        let image = Image::new(10, 10, pixels).unwrap();
        let said = |camera| remark(&image, &scene, || TriangleSoup::new(&scene), camera).unwrap();
        let lit = said(scene.view(1.0));
        assert!(lit.starts_with("99.0 % of the pixels are black"), "{lit}");
        assert!(lit.contains("its lights reach little"), "{lit}");
        let view = scene.view(1.0);
        let away = Camera {
            target: view.eye * 2.0 - view.target,
            ..view
        };
        assert!(said(away).contains("100 % of what the camera sees is a black sky"));
    }

    #[test]
    fn pictures_with_two_values_pass() {
        let scene = named("cornell-box").unwrap();
        let mut pixels = vec![[0.0; 3]; 16];
        pixels[15] = [0.0, 0.0, 1e-3];
        let image = Image::new(4, 4, pixels).unwrap();
        let soup = || -> TriangleSoup { unreachable!("the pixels differ") };
        assert_eq!(remark(&image, &scene, soup, scene.view(1.0)), None);
    }
}
