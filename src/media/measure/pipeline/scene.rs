//! What the lamp shines into, with the images that others are compared with.

use super::checks::{refracted_truth, truth_of};
use super::{Content, FOG, IMAGE, INTENSITY, LAMP, Load};
use crate::adaptive::Smoothing;
use crate::measure::failed;
use crate::medium::{Homogeneity, Key, Medium};
use crate::photons::{Points, point_set};
use crate::pipeline::oracle::{Fields, seen_by};
use crate::pipeline::ways::{Steps, Ways};
use crate::pipeline::{Mirror, Pipeline, PipelineError, Source, camera};
use crate::scatter::{Adding, Strategy};
use crate::voxels::{Mesh, coverage};
use crate::{MediaError, Volume, procedures, structure};
use glam::{DVec3, Vec3};
use raystone_bench::run::Absent;
use raystone_gpu::Gpu;
use raystone_image::{Image, Picture, automatic_exposure, displayed, tone_map};
use raystone_scene::named;
use raystone_stats::flip::Seen;

/// Pixels of the page along each axis of a pixel of the image.
const ENLARGED: u32 = 6;
/// The dense ball, and how many times as dense as the fog it is.
const BALL: DVec3 = DVec3::new(0.45, 0.6, 0.5);
const RADIUS: f64 = 0.15;
const DENSE: f32 = 40.0;
/// Glass, its middle, radius of the ball or half the side of the cube, and the part of the fog's σ that it has.
pub(super) const GLASS: f32 = 1.5;
const MIDDLE: DVec3 = DVec3::new(0.5, 0.62, 0.5);
const SIZE: f64 = 0.18;
const CLEAR: f32 = 0.25;
/// The line around which the torus is, and both of its radii.
const AXIS: DVec3 = DVec3::new(0.3, 1.0, 0.2);
const TORUS: [f64; 2] = [0.18, 0.08];
/// What noise adds to the cube's index, at most about.
const NOISE: f32 = 0.1;
/// Photons along each axis for each voxel along an axis that stand for the exact light where it is refracted.
const TRUE_PHOTONS: u32 = 6;
/// Photons along each axis of the image that has next to no noise.
const MANY: u32 = 1024;

impl Content {
    /// With a mesh, the name of a scene or of a file.
    fn volume(self, gpu: &Gpu, mesh: &str, side: u32) -> Result<Volume, Absent> {
        if (self == Self::Mesh) == mesh.is_empty() {
            return Err(Absent::Refused(
                "`mesh` names the mesh of content = \"mesh\": a scene or a file, and nothing of other contents".to_owned(),
            ));
        }
        match self {
            // 64 by 32 quads.
            Self::Torus => {
                let torus = Mesh::torus(MIDDLE, AXIS.normalize(), TORUS, 64);
                of_glass(gpu, &torus, side)
            }
            Self::Mesh => {
                let refused = |reason: String| Absent::Refused(format!("{mesh}: {reason}"));
                let scene = named(mesh).map_err(|error| Absent::Refused(error.to_string()))?;
                let mesh = Mesh::of_scene(&scene, MIDDLE, 2.0 * SIZE);
                of_glass(gpu, &mesh, side).map_err(|absent| match absent {
                    // The file's fault.
                    Absent::Failed(reason) => refused(reason),
                    absent => absent,
                })
            }
            _ => self.by_procedure(side).map_err(failed),
        }
    }

    /// All but those of meshes.
    fn by_procedure(self, side: u32) -> Result<Volume, MediaError> {
        let fog = |density: f32| [FOG[0] * density, FOG[1] * density, 1.0];
        match self {
            Self::Fog | Self::Torus | Self::Mesh => Volume::new([side; 3], |_| fog(1.0)),
            Self::Cloud => procedures::cloud(side),
            Self::Shadow => Volume::new([side; 3], |p| {
                // A border of one voxel.
                let depth = (RADIUS - (p - BALL).length()) * f64::from(side) + 0.5;
                fog(1.0 + (DENSE - 1.0) * depth.clamp(0.0, 1.0) as f32)
            }),
            Self::Ball => {
                let inside = |p: DVec3| (p - MIDDLE).length() < SIZE;
                let part = |p| procedures::coverage_of(side, p, inside);
                let [scattering, absorption, _] = fog(CLEAR);
                procedures::covered(side, part, fog(1.0), |_| [scattering, absorption, GLASS])
            }
            Self::Cube => {
                let inside = |p: DVec3| (p - MIDDLE).abs().max_element() < SIZE;
                let part = |p| procedures::coverage_of(side, p, inside);
                let noise = procedures::cube_noise();
                procedures::covered(side, part, fog(1.0), |p| {
                    let noise = noise(p);
                    let [scattering, absorption, _] = fog(CLEAR * (1.0 + 0.2 * noise));
                    [scattering, absorption, GLASS + NOISE * noise]
                })
            }
            Self::Lens => Volume::new([side; 3], |p| {
                // n² = 2 - (r / R)² (Luneburg 1944).
                let square = (p - MIDDLE).length_squared() / (SIZE * SIZE);
                let [scattering, absorption, _] = fog(1.0);
                [
                    scattering,
                    absorption,
                    (2.0 - square.min(1.0)).sqrt() as f32,
                ]
            }),
        }
    }

    /// The same of a grid that is smoothed: a caustic is as narrow as a voxel.
    pub(super) fn blur_of_smooth(self, side: u32) -> f64 {
        let times = if self.is_refractive() { 4.0 } else { 1.0 };
        self.blur(side) * times
    }

    /// What regions that are crossed in one step have in common.
    fn homogeneity(self) -> Homogeneity {
        if self.is_refractive() {
            // As in the thesis; where n is the same, steps are long.
            Homogeneity {
                key: Key::Refraction,
                epsilon: 0.0,
            }
        } else {
            Homogeneity::default()
        }
    }

    /// Whether light is refracted in it.
    pub(super) fn is_refractive(self) -> bool {
        matches!(
            self,
            Self::Ball | Self::Cube | Self::Lens | Self::Torus | Self::Mesh
        )
    }

    /// What the grid blurs: RMSE of an image, relative, at most. It falls as the square of a voxel's side in fog, and as the
    /// side where the medium has borders or details of any size.
    pub(super) fn blur(self, side: u32) -> f64 {
        let side = f64::from(side);
        match self {
            Self::Fog => 6.0 / (side * side),
            Self::Cloud => 1.6 / side,
            Self::Shadow => (8.0 / (side * side)).max(0.8 / side),
            // Both images have the same grid: what ways of longer steps move.
            Self::Ball | Self::Cube | Self::Lens | Self::Torus | Self::Mesh => 0.4 / side,
        }
    }
}

/// A closed mesh of glass in fog.
fn of_glass(gpu: &Gpu, mesh: &Mesh, side: u32) -> Result<Volume, Absent> {
    let parts = coverage(gpu, mesh, side)?;
    let found = parts.iter().map(|part| f64::from(*part)).sum::<f64>() / f64::from(side).powi(3);
    // Middles of cells: a half of one at most along all of its surface.
    let slack = mesh.area() / f64::from(8 * side);
    if (found - mesh.volume()).abs() > slack {
        return Err(Absent::Failed(format!(
            "voxels of the mesh enclose {found:.4} where its triangles do {:.4}, beside a slack of {slack:.4}: parts of it overlap, or are inside out",
            mesh.volume()
        )));
    }
    let at = |p: DVec3| {
        let voxel = (p * f64::from(side))
            .as_uvec3()
            .min(glam::UVec3::splat(side - 1));
        parts[(voxel.x + side * (voxel.y + side * voxel.z)) as usize]
    };
    let glass = [FOG[0] * CLEAR, FOG[1] * CLEAR, GLASS];
    let volume = procedures::covered(side, at, [FOG[0], FOG[1], 1.0], |_| glass);
    volume.map_err(failed)
}

/// The parts of an image: what refraction lights, what it darkens, and the rest. True where a pixel is of the part.
type Parts = [Vec<bool>; 3];

/// By how much refraction has to change a pixel.
const CHANGED: f64 = 0.15;

/// Pixels that the light of many photons meets otherwise than that of as many that go straight on, both seen along the same ways.
fn parts_of(
    gpu: &Gpu,
    (volume, medium): (&Volume, &Medium),
    rays: &[(DVec3, DVec3)],
    many: &[Vec3],
    points: Vec<([f64; 2], f64)>,
) -> Result<Parts, Absent> {
    let mut straight = volume.clone();
    straight.refraction.fill(1.0);
    let straight = straight.checked().map_err(failed)?;
    let homogeneity = Homogeneity::default();
    let over = Medium::new(&straight, medium.structure.clone(), homogeneity);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let mut pipeline = Pipeline::new(gpu, (&straight, &over), adding, lamp(), points)?;
    pipeline.set_view(rays);
    pipeline.render()?;
    let radiance = pipeline.radiance()?;
    let ways = Ways::of(volume, medium, Steps::Regions);
    let seen = seen_by(&Fields::new(medium), ways.as_ref(), volume, &radiance, rays);
    let seen = seen.map_err(PipelineError::from)?;
    let changes: Vec<f64> = (many.iter().zip(seen))
        .map(|(with, without)| {
            f64::from(with.element_sum()) / without.element_sum().max(1e-9) - 1.0
        })
        .collect();
    let part = |is_of: &dyn Fn(f64) -> bool| changes.iter().map(|change| is_of(*change)).collect();
    Ok([
        part(&|change| change > CHANGED),
        part(&|change| change < -CHANGED),
        part(&|change| change.abs() <= CHANGED),
    ])
}

/// A medium under the lamp.
pub(super) struct Scene {
    content: Content,
    mesh: String,
    side: u32,
    kernels: String,
    mirror: Option<Mirror>,
    pub(super) volume: Volume,
    pub(super) medium: Medium,
    pub(super) rays: Vec<(DVec3, DVec3)>,
    /// Radiance of each ray for an intensity of 1, by a quadrature.
    pub(super) truth: Vec<f64>,
    /// The image of 2²⁰ even photons, not smoothed.
    pub(super) many: Vec<Vec3>,
    /// Its parts, where light is refracted.
    parts: Option<Parts>,
}

impl Scene {
    pub(super) fn is_of(&self, load: &Load, kernels: &str) -> bool {
        self.content == load.content
            && self.mesh == load.mesh
            && self.side == load.side
            && self.volume.phase == load.phase()
            && self.kernels == kernels
            && self.mirror == load.mirror(INTENSITY)
    }

    /// The volume with a level map over it, and its images.
    pub(super) fn new(gpu: &Gpu, load: &Load, kernels: &str) -> Result<Self, Absent> {
        if load.reflectivity > 0.0 && !load.content.is_refractive() {
            return Err(Absent::Refused(
                "nothing is refracted here, so that no surface of an index reflects: take `reflectivity` of 0"
                    .to_owned(),
            ));
        }
        let mut volume = load.content.volume(gpu, &load.mesh, load.side)?;
        volume.phase = load.phase();
        let made = structure::registry()
            .find("level-map")
            .map(|kind| kind.make(&Default::default()));
        let Some(Ok(structure)) = made else {
            return Err(Absent::Failed("there is no level map".to_owned()));
        };
        let medium = Medium::new(&volume, structure, load.content.homogeneity());
        let rays = view();
        let truth = if load.content.is_refractive() {
            refracted_truth(
                &volume,
                &medium,
                &rays,
                TRUE_PHOTONS * load.side,
                load.mirror(Vec3::ONE),
            )?
        } else {
            truth_of(&volume, &medium, LAMP, &rays)
        };
        if truth.iter().all(|light| *light <= 0.0) {
            let side = load.side;
            return Err(Absent::Refused(format!(
                "nothing scatters light in {side}³ voxels of this content: give more"
            )));
        }
        let points = point_set(Points::Hammersley, MANY, 0).map_err(Absent::Failed)?;
        let points: Vec<_> = points.into_iter().map(|point| (point, 1.0)).collect();
        let adding = Adding::new(Strategy::Fixed64, 0);
        let mut pipeline = Pipeline::new(gpu, (&volume, &medium), adding, lamp(), points.clone())?;
        pipeline.set_smoothing(Smoothing::default());
        pipeline.set_view(&rays);
        let bare = pipeline.render()?.image;
        let parts = if load.content.is_refractive() {
            Some(parts_of(gpu, (&volume, &medium), &rays, &bare, points)?)
        } else {
            None
        };
        // Parts are those of refraction alone.
        let mirror = load.mirror(INTENSITY);
        pipeline.set_mirror(mirror);
        let many = pipeline.render()?.image;
        Ok(Self {
            mirror,
            content: load.content,
            mesh: load.mesh.clone(),
            side: load.side,
            kernels: kernels.to_owned(),
            volume,
            medium,
            rays,
            truth,
            many,
            parts,
        })
    }

    /// RMSE of an image from that of many photons, as a part of its mean.
    pub(super) fn noise(&self, image: &[Vec3]) -> f64 {
        self.noise_where(image, |_| true)
    }

    /// The same of the pixels that refraction lights, of those that it darkens and of the rest, as parts of the whole image's mean.
    pub(super) fn noise_of_parts(&self, image: &[Vec3]) -> Option<[f64; 3]> {
        let parts = self.parts.as_ref()?;
        Some([0, 1, 2].map(|k| self.noise_where(image, |pixel| parts[k][pixel])))
    }

    /// Mean FLIP of an image from that of many photons, at the exposure of the latter, each pixel as one of a display.
    pub(super) fn flip(&self, image: &[Vec3]) -> f64 {
        mean_where(&self.flips(image), |_| true)
    }

    /// The same of the parts of [`Self::noise_of_parts`].
    pub(super) fn flip_of_parts(&self, image: &[Vec3]) -> Option<[f64; 3]> {
        let parts = self.parts.as_ref()?;
        let flips = self.flips(image);
        Some([0, 1, 2].map(|k| mean_where(&flips, |pixel| parts[k][pixel])))
    }

    fn flips(&self, image: &[Vec3]) -> Vec<f64> {
        let pixels = self.many.iter().map(|pixel| pixel.to_array()).collect();
        let exposure =
            Image::new(IMAGE, IMAGE, pixels).map_or(1.0, |many| automatic_exposure(&many));
        let seen = |image: &[Vec3]| {
            let pixels: Vec<[f64; 3]> = (image.iter())
                .map(|pixel| displayed(&pixel.to_array(), exposure))
                .collect();
            Seen::new(&pixels, IMAGE as usize)
        };
        seen(image).difference(&seen(&self.many))
    }

    /// 0 where there is no such pixel.
    fn noise_where(&self, image: &[Vec3], is_of: impl Fn(usize) -> bool) -> f64 {
        let (mut square, mut count, mut mean) = (0.0, 0.0, 0.0);
        for (pixel, (found, exact)) in image.iter().zip(&self.many).enumerate() {
            mean += f64::from(exact.element_sum());
            if is_of(pixel) {
                square += f64::from((*found - *exact).length_squared());
                count += 3.0;
            }
        }
        let mean = mean / (3.0 * image.len() as f64);
        (square / f64::max(count, 1.0)).sqrt() / mean
    }
}

/// 0 where there is no such pixel.
fn mean_where(values: &[f64], is_of: impl Fn(usize) -> bool) -> f64 {
    let of = || values.iter().enumerate().filter(|(pixel, _)| is_of(*pixel));
    of().map(|(_, value)| value).sum::<f64>() / of().count().max(1) as f64
}

/// The lamp, whose colours differ.
pub(super) fn lamp() -> Source {
    Source::Point {
        position: LAMP,
        intensity: INTENSITY,
    }
}

/// Rays of the image.
pub(super) fn view() -> Vec<(DVec3, DVec3)> {
    camera(DVec3::new(0.6, 0.4, -1.6), DVec3::splat(0.5), 0.35, IMAGE)
}

/// The image as a picture, each pixel as a square; `None` without an image.
pub(super) fn drawn(image: &[Vec3]) -> Option<Picture> {
    let side = IMAGE * ENLARGED;
    let pixel = |at: u32| {
        let [x, y] = [at % side, at / side].map(|c| c / ENLARGED);
        image[(y * IMAGE + x) as usize].to_array()
    };
    let pixels = (0..side * side).map(pixel).collect();
    let image = Image::new(side, side, pixels).ok()?;
    Some(tone_map(&image, automatic_exposure(&image)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::box_triangles;
    use crate::tests::segments::adapter;

    /// The faces of a cube of side 2 around a point on the x-axis, which turn outwards.
    fn cube(first: u32, x: f32) -> String {
        let mut text = String::new();
        for k in 0..8 {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let [dx, dy, dz] = [0, 1, 2].map(sign);
            text += &format!("v {} {dy} {dz}\n", x + dx);
        }
        for triangle in box_triangles() {
            let [a, b, c] = triangle.map(|corner| corner + 1 + first);
            text += &format!("f {a} {b} {c}\n");
        }
        text
    }

    #[test]
    fn a_cube_from_a_file_is_the_cube_of_a_formula_and_others_than_closed_meshes_are_refused() {
        let Some(gpu) = adapter() else { return };
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path.to_str().unwrap().to_owned()
        };
        let side = 20;
        let sound = file("cube.obj", &cube(0, 5.0));
        let Ok(found) = Content::Mesh.volume(&gpu, &sound, side) else {
            panic!("refused");
        };
        let inside = |p: DVec3| (p - MIDDLE).abs().max_element() < SIZE;
        let part = |p| procedures::coverage_of(side, p, inside);
        let glass = [FOG[0] * CLEAR, FOG[1] * CLEAR, GLASS];
        let expected = procedures::covered(side, part, [FOG[0], FOG[1], 1.0], |_| glass).unwrap();
        assert_eq!(found.refraction, expected.refraction);
        assert_eq!(found.scattering, expected.scattering);

        let open: String = (cube(0, 0.0).lines().take(19))
            .map(|line| format!("{line}\n"))
            .collect();
        let open = file("open.obj", &open);
        let two = file("two.obj", &(cube(0, 0.0) + &cube(8, 0.5)));
        let missing = folder.path().join("no.obj").to_str().unwrap().to_owned();
        for (content, mesh, reason) in [
            (Content::Mesh, &*open, "the mesh is open: 3 edges"),
            (Content::Mesh, &two, "parts of it overlap"),
            (Content::Mesh, &missing, "no.obj"),
            (Content::Mesh, "", "names the mesh"),
            (Content::Ball, &sound, "names the mesh"),
        ] {
            let Err(Absent::Refused(found)) = content.volume(&gpu, mesh, side) else {
                panic!("{mesh} is not refused");
            };
            assert!(found.contains(reason), "{found}");
        }
    }

    #[test]
    fn errors_of_an_image_are_those_of_its_parts() {
        let Some(gpu) = adapter() else { return };
        let load = Load {
            content: Content::Ball,
            side: 12,
            ..Load::default()
        };
        let scene = Scene::new(&gpu, &load, "").unwrap_or_else(|_| panic!("no scene"));
        assert_eq!(scene.flip(&scene.many), 0.0);
        assert_eq!(scene.flip_of_parts(&scene.many), Some([0.0; 3]));
        let dimmed: Vec<Vec3> = scene.many.iter().map(|pixel| *pixel * 0.5).collect();
        let whole = scene.flip(&dimmed);
        let parts = scene.flip_of_parts(&dimmed).unwrap();
        let sizes = scene.parts.as_ref().unwrap();
        let sizes = [0, 1, 2].map(|k| sizes[k].iter().filter(|is_of| **is_of).count() as f64);
        let mean = (0..3).map(|k| sizes[k] * parts[k]).sum::<f64>() / sizes.iter().sum::<f64>();
        assert!(sizes.iter().all(|size| *size > 0.0), "{sizes:?}");
        assert!(
            (mean - whole).abs() < 1e-12 && whole > 0.05,
            "{mean} {whole}"
        );

        // A tenth of the mean is added to all channels of one part's pixels.
        let sum: f64 = (scene.many.iter())
            .map(|p| f64::from(p.element_sum()))
            .sum();
        let tenth = 0.1 * sum / (3.0 * scene.many.len() as f64);
        let kinds = scene.parts.as_ref().unwrap();
        for (k, kind) in kinds.iter().enumerate() {
            let pixels = scene.many.iter().zip(kind);
            let raised: Vec<Vec3> = pixels
                .map(|(pixel, is_of)| pixel + Vec3::splat(f64::from(*is_of) as f32 * tenth as f32))
                .collect();
            let mut expected = [0.0; 3];
            expected[k] = 0.1;
            let found = scene.noise_of_parts(&raised).unwrap();
            let whole = 0.1 * (sizes[k] / scene.many.len() as f64).sqrt();
            let close = |a: f64, b: f64| (a - b).abs() < 1e-6;
            assert!((0..3).all(|j| close(found[j], expected[j])), "{found:?}");
            assert!(close(scene.noise(&raised), whole), "{whole}");
        }
    }
}
