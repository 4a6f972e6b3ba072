//! The estimators: primary visibility, ambient occlusion, path tracing.

use super::bsdf::{self, Bounce, Bsdf, Reflected};
use super::connection::Before;
use super::hits::{Blocked, SHORT, Segment};
use super::light::{Choice, Chosen, moved};
use super::medium::Flight;
use super::surface::Surface;
use super::{PathOracle, Vertex, Walk};
use glam::DVec3;
use raystone_core::params::{ParamValue, Params};
use raystone_render::{ConfiguredIntegrator, CountedRays};

// The dimensions of a path, written down here once more: were they those of the crate of samplers, a fault in
// both its table and the kernels' would look right.
const PIXEL: u32 = 0;
const DIRECTION: u32 = 0;
const LIGHT_POINT: u32 = 2;
const LIGHT_CHOICE: u32 = 4;
const ROULETTE: u32 = 5;

/// Dimension of a purpose at a bounce: two of the pixel, then six of each bounce.
fn at_bounce(bounce: u32, purpose: u32) -> u32 {
    2 + 6 * bounce + purpose
}

/// The value estimated by a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Estimator {
    /// Base colour of the first hit times the cosine to the viewer, and its emission.
    Primary,
    /// Visibility along a cosine-distributed ray of limited length.
    Occlusion {
        /// Ray length as a fraction of the scene's diagonal.
        radius: f64,
    },
    /// The radiance of a path.
    Path(PathRules),
}

/// The rules of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathRules {
    max_depth: u32,
    /// The weighting of light samples and found emission.
    pub(super) strategy: Strategy,
    /// True for `connection = "specular"`.
    pub(super) is_connected: bool,
    roulette: Roulette,
    /// First bounce with Russian roulette.
    roulette_depth: u32,
    pub(super) choice: Choice,
    /// Clamp for the largest component of a contribution from bounce 1 on; 0 disables it.
    clamp: f64,
    /// True if the path begins with a ray through the pixel centre.
    centred: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Strategy {
    /// Both, weighted by densities to this power.
    Both(i32),
    Material,
    Light,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Roulette {
    None,
    Albedo,
    Throughput,
}

const SURVIVAL: f64 = 0.95;

/// Reads parameters and notes which were read.
struct Reader<'a> {
    name: &'a str,
    params: &'a Params,
    known: Vec<&'static str>,
}

impl Reader<'_> {
    fn get(&mut self, key: &'static str) -> Option<&ParamValue> {
        self.known.push(key);
        self.params.0.get(key)
    }

    fn number(&mut self, key: &'static str, missing: f64) -> f64 {
        match self.get(key) {
            Some(ParamValue::Number(x)) => *x,
            Some(ParamValue::Integer(x)) => *x as f64,
            _ => missing,
        }
    }

    fn choice<T: Copy>(&mut self, key: &'static str, of: &[(&str, T)]) -> Result<T, String> {
        let name = self.name.to_owned();
        match self.get(key) {
            None => Ok(of[0].1),
            Some(value) => {
                let value = value.to_string();
                let found = of.iter().find(|(word, _)| *word == value);
                let found = found.map(|(_, meaning)| *meaning);
                found.ok_or_else(|| format!("`{key} = {value}` of `{name}`"))
            }
        }
    }

    fn light_choice(&mut self) -> Result<Choice, String> {
        let by = [
            ("power", Choice::Power),
            ("uniform", Choice::Uniform),
            ("tree", Choice::Tree),
        ];
        let by = self.choice("light_choice", &by)?;
        self.choice("lights", &[("one", by), ("all", Choice::All)])
    }

    /// Fails if a parameter was not read.
    fn finish(&self) -> Result<(), String> {
        let unknown = |key: &&String| !self.known.contains(&key.as_str());
        match self.params.0.keys().find(unknown) {
            Some(key) => Err(format!("parameter `{key}` of integrator `{}`", self.name)),
            None => Ok(()),
        }
    }
}

impl Estimator {
    /// The estimator of an integrator.
    ///
    /// # Errors
    /// The part of the integrator that the oracle does not support.
    pub fn of(integrator: &ConfiguredIntegrator) -> Result<Self, String> {
        let name = integrator.kind.name();
        let mut read = Reader {
            name,
            params: &integrator.params,
            known: Vec::new(),
        };
        // The other kernel parameters do not change the image.
        if name == "path" {
            read.get("carry");
        }
        let estimator = match name {
            "primary" => Self::Primary,
            "ao" => Self::Occlusion {
                radius: read.number("radius", 0.1),
            },
            "path" => Self::Path(PathRules {
                max_depth: read.number("max_depth", 6.0) as u32,
                strategy: read.choice(
                    "strategy",
                    &[
                        ("mis-balance", Strategy::Both(1)),
                        ("mis-power", Strategy::Both(2)),
                        ("bsdf", Strategy::Material),
                        ("light", Strategy::Light),
                    ],
                )?,
                is_connected: read.choice("connection", &[("none", false), ("specular", true)])?,
                roulette: read.choice(
                    "roulette",
                    &[
                        ("throughput", Roulette::Throughput),
                        ("albedo", Roulette::Albedo),
                        ("none", Roulette::None),
                    ],
                )?,
                roulette_depth: read.number("roulette_depth", 3.0) as u32,
                choice: read.light_choice()?,
                clamp: read.number("clamp", 0.0),
                centred: read.choice("primary", &[("traced", false), ("centre", true)])?,
            }),
            _ => return Err(format!("integrator `{name}`")),
        };
        read.finish()?;
        Ok(estimator)
    }
}

impl Strategy {
    /// Weight of a sample with density `own` that the other strategy finds with density `other`.
    pub(super) fn weight(self, own: f64, other: f64) -> f64 {
        match self {
            Self::Both(power) => 1.0 / (1.0 + (other / own).powi(power)),
            Self::Material | Self::Light => 1.0,
        }
    }
}

impl Strategy {
    /// Weight of emission found by a direction of this density; `other` is that of light sampling.
    pub(super) fn found(self, density: Option<f64>, other: impl FnOnce() -> f64) -> f64 {
        match (density, self) {
            (None, _) => 1.0,
            (Some(_), Self::Light) => 0.0,
            (Some(density), _) => self.weight(density, other()),
        }
    }
}

impl PathRules {
    fn clamped(&self, depth: u32, light: DVec3) -> DVec3 {
        let greatest = light.max_element();
        if self.clamp > 0.0 && depth > 0 && greatest > self.clamp {
            light * (self.clamp / greatest)
        } else {
            light
        }
    }
}

struct State {
    ray: Segment,
    throughput: DVec3,
    radiance: DVec3,
    /// Density of the last direction, if light sampling could have found it.
    density: Option<f64>,
    /// The vertex before the mirror that the ray comes from, if connections may know of it.
    before: Option<Before>,
    medium: f64,
}

impl PathOracle<'_> {
    pub(super) fn estimate(&self, walk: &mut Walk) -> DVec3 {
        let lens = walk.lens();
        let point = match walk.view.estimator {
            Estimator::Path(PathRules { centred: true, .. }) => [0.5; 2],
            _ => walk.draw_2d(PIXEL),
        };
        let direction = lens.direction(walk.id.pixel, point);
        let direction = walk.rounding.direction(direction);
        let ray = Segment::endless(lens.eye, direction, None);
        match walk.view.estimator {
            Estimator::Primary => self.primary(walk, &ray),
            Estimator::Occlusion { radius } => self.occlusion(walk, &ray, radius),
            Estimator::Path(rules) => self.path(walk, ray, &rules),
        }
    }

    /// The first hit on a ray, recorded.
    fn meet(&self, walk: &mut Walk, ray: &Segment) -> Option<(Surface<'_>, f64)> {
        let moved = walk.rounding.point(ray.origin, ray.origin.abs()) - ray.origin;
        let seen = Segment {
            start: ray.start + moved,
            origin: ray.origin + moved,
            shift: walk.rounding.texel(),
            ..*ray
        };
        let class = if walk.vertices.is_empty() {
            CountedRays::Primary
        } else {
            CountedRays::Bounce
        };
        walk.note_ray(class, 0, &seen);
        let met = self.hits.nearest(&seen, &mut walk.rounding);
        walk.decide_met(met.as_ref());
        let hit = self.hits.unmoved(met?.hit, &seen);
        let surface = self.surface(ray, &hit, &mut walk.rounding);
        walk.vertices.push(Vertex {
            position: surface.position,
            triangle: hit.triangle,
            material: surface.material.name.clone(),
            throughput: DVec3::ONE,
            direct: DVec3::ZERO,
        });
        Some((surface, hit.distance))
    }

    fn primary(&self, walk: &mut Walk, ray: &Segment) -> DVec3 {
        match self.meet(walk, ray) {
            None => self.escaped(ray.direction),
            Some((surface, _)) => {
                surface.base * surface.geometric.dot(surface.out).abs() + surface.emission
            }
        }
    }

    fn occlusion(&self, walk: &mut Walk, ray: &Segment, radius: f64) -> DVec3 {
        let Some((surface, _)) = self.meet(walk, ray) else {
            return DVec3::ONE;
        };
        let uv = walk.draw_2d(at_bounce(0, DIRECTION));
        let direction = bsdf::cosine_direction(surface.normal, uv);
        let direction = walk.rounding.direction(direction);
        let free = Segment {
            length: walk.rounding.number(radius * self.diagonal),
            ..surface.leave(direction, &mut walk.rounding)
        };
        walk.note_ray(CountedRays::Ao, 0, &free);
        let blocked = self.hits.blocked(&free, &mut walk.rounding);
        walk.decide_blocked(blocked);
        DVec3::splat(if blocked == Blocked::No { 1.0 } else { 0.0 })
    }

    fn path(&self, walk: &mut Walk, ray: Segment, rules: &PathRules) -> DVec3 {
        let mut state = State {
            ray,
            throughput: DVec3::ONE,
            radiance: DVec3::ZERO,
            density: None,
            before: None,
            medium: 1.0,
        };
        for depth in 0..=rules.max_depth {
            let met = self.meet(walk, &state.ray);
            let end = met
                .as_ref()
                .map_or(f64::INFINITY, |(_, distance)| *distance);
            let ball = self.sphere_met(&state.ray, end, rules.choice, &mut walk.rounding);
            let until = ball.as_ref().map_or(end, |ball| ball.distance);
            let first = (!self.media.is_empty() && depth < rules.max_depth)
                .then(|| walk.draw(at_bounce(depth, ROULETTE)));
            let way = (&state.ray, until);
            let flight = self.flight(walk, way, depth, first, &mut state.throughput);
            if let Some(flight) = flight {
                if !self.scatter(walk, &flight, depth, &mut state, rules) {
                    break;
                }
                continue;
            }
            if let Some(ball) = ball {
                walk.decide(4);
                let weight = match state.before {
                    Some(before) => {
                        let end = state.ray.start + ball.distance * state.ray.direction;
                        let point = (ball.light, end, ball.cosine);
                        self.found_over_mirror(walk, &before, point, rules)
                    }
                    None => rules.strategy.found(state.density, || ball.density),
                };
                let found = ball.radiance * weight;
                state.radiance += rules.clamped(depth, state.throughput * found);
                break;
            }
            let leaves = |distance: f64| depth > 0 && self.escapes(distance);
            let met = met.filter(|(_, d)| !leaves(walk.rounding.number(*d)));
            let Some((surface, _)) = met else {
                walk.decide(2);
                let found = self.escaped_found(walk, &state, rules);
                state.radiance += rules.clamped(depth, state.throughput * found);
                break;
            };
            let found = surface.emission * self.emission_weight(walk, &surface, &state, rules);
            state.radiance += rules.clamped(depth, state.throughput * found);
            if depth == rules.max_depth {
                break;
            }
            let bsdf = surface.bsdf();
            if !(self.lights.are_none() || bsdf.is_delta() || rules.strategy == Strategy::Material)
            {
                let direct = self.direct(walk, &surface, &*bsdf, depth, rules);
                state.radiance += rules.clamped(depth, state.throughput * direct);
                if let Some(vertex) = walk.vertices.last_mut() {
                    vertex.direct = state.throughput * direct;
                }
            }
            let before = (rules.connects() && state.density.is_some())
                .then(|| self.before(walk, (&state.ray, state.density), &surface));
            if !self.go_on(walk, &surface, &*bsdf, depth, &mut state, rules) {
                break;
            }
            state.before = before.flatten();
        }
        walk.rounding.colour(state.radiance)
    }

    /// Weight of the emission of a surface that the path has met.
    fn emission_weight(
        &self,
        walk: &mut Walk,
        surface: &Surface,
        state: &State,
        rules: &PathRules,
    ) -> f64 {
        let Some(before) = state.before else {
            let rounding = &mut walk.rounding;
            let other = || self.light_density(surface, &state.ray, rules.choice, rounding);
            return rules.strategy.found(state.density, other);
        };
        let owner = self.lights.owner(surface.triangle);
        owner
            .filter(|_| surface.emission != DVec3::ZERO)
            .map_or(1.0, |light| {
                let cosine = surface.geometric.dot(surface.out);
                let point = (light, surface.position, cosine);
                self.found_over_mirror(walk, &before, point, rules)
            })
    }

    /// Scatters a path in the medium; false if it ends.
    fn scatter(
        &self,
        walk: &mut Walk,
        flight: &Flight,
        depth: u32,
        state: &mut State,
        rules: &PathRules,
    ) -> bool {
        let point = self.scattered(walk, &state.ray, depth, flight);
        state.throughput *= walk.rounding.colour(flight.albedo);
        if depth == rules.max_depth || flight.albedo == DVec3::ZERO {
            return false;
        }
        let phase = self.phase(&point, flight.medium);
        state.before = None;
        if !(self.lights.are_none() || rules.strategy == Strategy::Material) {
            let direct = self.direct(walk, &point, &phase, depth, rules);
            state.radiance += rules.clamped(depth, state.throughput * direct);
            if let Some(vertex) = walk.vertices.last_mut() {
                vertex.direct = state.throughput * direct;
            }
        }
        self.go_on(walk, &point, &phase, depth, state, rules)
    }

    /// Reflected and weighted light from a sample of one light, or of all lights.
    fn direct(
        &self,
        walk: &mut Walk,
        surface: &Surface,
        bsdf: &dyn Bsdf,
        depth: u32,
        rules: &PathRules,
    ) -> DVec3 {
        let point = walk.draw_2d(at_bounce(depth, LIGHT_POINT));
        let number = walk.draw(at_bounce(depth, LIGHT_CHOICE));
        let at = (surface.position, surface.geometric);
        let chosen = self.chosen(rules.choice, number, at, &mut walk.rounding);
        let mut sum = DVec3::ZERO;
        for chosen in chosen {
            let point = match rules.choice {
                Choice::All => moved(point, chosen.light),
                _ => point,
            };
            let light = chosen.light;
            let over = rules.connects() && depth + 2 <= rules.max_depth;
            if over {
                let light = (&chosen, point);
                sum += self.over_mirrors(walk, (surface, bsdf), depth, light, rules);
            }
            let found = self.of_light(walk, surface, bsdf, (chosen, point), rules.strategy);
            if let Some((found, shadow)) = found {
                sum += found * self.passes(walk, &shadow, depth, light);
            }
        }
        sum
    }

    /// Weighted radiance of a ray that leaves the scene.
    fn escaped_found(&self, walk: &mut Walk, state: &State, rules: &PathRules) -> DVec3 {
        let light = self.escaped(state.ray.direction);
        let rounding = &mut walk.rounding;
        match self.escaped_density(&state.ray, rules.choice, rounding) {
            Some((texel, other)) => {
                walk.decide(texel as u64);
                light * rules.strategy.found(state.density, || other)
            }
            None => light,
        }
    }

    /// Light from a sample of a chosen light, but for the medium before it, and its shadow ray; `None` if none arrives.
    fn of_light(
        &self,
        walk: &mut Walk,
        surface: &Surface,
        bsdf: &dyn Bsdf,
        (chosen, point): (Chosen, [f64; 2]),
        strategy: Strategy,
    ) -> Option<(DVec3, Segment)> {
        walk.decide(chosen.light as u64);
        let before = walk.rounding.by_chance();
        let (part, light) = self.light_sample(surface, &chosen, point, &mut walk.rounding);
        walk.decide(part as u64);
        if walk.rounding.by_chance() > before {
            walk.decide_shining(light.is_some());
        }
        let light = light.filter(|l| l.density.is_none_or(f64::is_finite))?;
        let reflected = bsdf.reflect(light.direction, &mut walk.rounding);
        let Reflected { value, density } = reflected?;
        // Towards the light's point, wherever the ray starts.
        let left = surface.leave(light.direction, &mut walk.rounding);
        let towards = left.start + light.direction * light.distance - left.origin;
        let distance = towards.length();
        let shadow = Segment {
            to: light.triangles,
            length: distance * (1.0 - SHORT),
            direction: towards / distance,
            ..left
        };
        let blocked = self.shadowed(walk, &shadow, (chosen.light, true));
        walk.decide_blocked(blocked);
        if blocked != Blocked::No {
            return None;
        }
        let weight = match light.density {
            Some(own) => strategy.weight(chosen.share * own, density) / own,
            None => 1.0,
        };
        Some((value * light.radiance * (weight / chosen.share), shadow))
    }

    /// Continues a path to its next ray; false if it ends.
    fn go_on(
        &self,
        walk: &mut Walk,
        surface: &Surface,
        bsdf: &dyn Bsdf,
        depth: u32,
        state: &mut State,
        rules: &PathRules,
    ) -> bool {
        let uv = walk.draw_2d(at_bounce(depth, DIRECTION));
        let Some(bounce) = bsdf.sample(uv, &mut walk.rounding) else {
            walk.decide(3);
            return false;
        };
        let Bounce {
            direction,
            weight,
            density,
            medium,
        } = bounce;
        walk.decide(u64::from(direction.dot(surface.geometric) > 0.0));
        state.throughput *= walk.rounding.colour(weight);
        state.medium *= medium;
        if let Some(vertex) = walk.vertices.last_mut() {
            vertex.throughput = state.throughput;
        }
        let brightest = state.throughput.max_element() * state.medium;
        if brightest <= 0.0 {
            return false;
        }
        let survival = match rules.roulette {
            Roulette::None => None,
            Roulette::Throughput => Some(brightest),
            Roulette::Albedo => Some(weight.max_element() * medium),
        };
        if let Some(survival) = survival.filter(|_| depth >= rules.roulette_depth) {
            let survival = survival.min(SURVIVAL);
            let number = self.survival(walk, depth);
            let number = number.unwrap_or_else(|| walk.draw(at_bounce(depth, ROULETTE)));
            let ends = number >= walk.rounding.share(survival);
            walk.decide(ends.into());
            if ends {
                return false;
            }
            state.throughput /= survival;
        }
        // Light sampling finds no delta direction, and nothing at all if no light can be sampled.
        state.density = density;
        state.ray = surface.leave(direction, &mut walk.rounding);
        true
    }
}
