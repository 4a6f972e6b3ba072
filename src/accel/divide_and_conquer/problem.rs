//! The division on the host, level by level. CPU version of `kernels/accel/divide_and_conquer/problem.wesl`
//! and its passes.

use super::Options;
use super::layout::Layout;
use crate::bounds::{Bounds, enter_box};
use crate::triangle::intersect_triangle;
use crate::{AccelError, Hit, NO_HIT, Query, Ray, TriangleSoup};
use raystone_core::params::{Parameters as _, Params};

/// What a level of problems holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DivisionLevel {
    /// Problems, with rays or without.
    pub problems: u64,
    /// Pairs of a problem and a ray that enters its box.
    pub pairs: u64,
    /// Pairs for whose parts a stream of the device had no room.
    pub without_room: u64,
}

/// A division of triangles and rays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Division {
    /// Levels, the first problem first; none has a stream that is too short.
    pub levels: Vec<DivisionLevel>,
    /// The nearest hit of each ray, or some hit where any is enough.
    pub hits: Vec<Hit>,
    /// Tests of a ray against the box of a problem.
    pub box_tests: u64,
    /// Tests of a ray against a triangle.
    pub tests: u64,
    any: bool,
}

/// Some triangles, and the rays that enter the box around them.
#[derive(Debug, Default)]
struct Problem {
    triangles: Vec<u32>,
    rays: Vec<u32>,
}

/// Where the triangles of a problem are divided.
struct Cut {
    axis: usize,
    position: f32,
}

impl Division {
    /// Divides the triangles of a soup and `rays` on the host, in the batches of the device. Problems are those of the
    /// last batch, pairs and tests of all.
    ///
    /// # Errors
    /// Unknown parameters.
    pub fn new(
        soup: &TriangleSoup,
        params: &Params,
        query: Query,
        rays: &[Ray],
    ) -> Result<Self, AccelError> {
        let options = Options::from_params(params)?;
        let raised = |ray: &Ray| {
            if ray.is_ray() {
                soup.intersection.raised(ray)
            } else {
                *ray
            }
        };
        let rays: Vec<Ray> = rays.iter().map(raised).collect();
        let mut division = Self {
            levels: vec![DivisionLevel::default(); options.levels as usize],
            hits: rays.iter().map(Hit::miss).collect(),
            any: query == Query::Any,
            ..Self::default()
        };
        let count = rays.len() as u32;
        let layout = Layout::new(count, soup.records.len() as u32, &options);
        for first in (0..count).step_by(layout.batch as usize) {
            let batch = first..count.min(first + layout.batch);
            let batch = batch.filter(|ray| rays[*ray as usize].is_ray()).collect();
            division.divide(soup, &options, &rays, batch);
        }
        Ok(division)
    }

    /// All levels for a batch of rays.
    fn divide(&mut self, soup: &TriangleSoup, options: &Options, rays: &[Ray], batch: Vec<u32>) {
        let all: Vec<u32> = (0..soup.records.len() as u32).collect();
        let mut problems = vec![self.part(soup, rays, all, &batch)];
        for level in 0..self.levels.len() {
            let pairs: usize = problems.iter().map(|problem| problem.rays.len()).sum();
            self.levels[level].pairs += pairs as u64;
            self.levels[level].problems = problems.len() as u64;
            if pairs == 0 {
                problems.clear();
                continue;
            }
            let is_last = level + 1 == self.levels.len();
            let is_divided = |p: &Problem| !is_last && p.is_divisible(soup, options.naive as usize);
            let (divided, answered): (Vec<_>, Vec<_>) = problems.into_iter().partition(is_divided);
            for problem in answered {
                self.answer(soup, rays, &problem);
            }
            problems = Vec::with_capacity(2 * divided.len());
            for problem in divided {
                for triangles in problem.halves(soup) {
                    problems.push(self.part(soup, rays, triangles, &problem.rays));
                }
            }
        }
    }

    /// A part, with those of the rays that enter its box. CPU version of `enters`.
    fn part(
        &mut self,
        soup: &TriangleSoup,
        rays: &[Ray],
        triangles: Vec<u32>,
        given: &[u32],
    ) -> Problem {
        if triangles.is_empty() {
            return Problem::default();
        }
        let around = around(soup, &triangles);
        let is_open = |ray: &&u32| !self.is_answered(**ray);
        let given: Vec<u32> = given.iter().filter(is_open).copied().collect();
        self.box_tests += given.len() as u64;
        let enters = |ray: &u32| {
            let (ray, end) = (&rays[*ray as usize], self.hits[*ray as usize].t);
            let inverse = soup.intersection.inverse(ray.direction);
            enter_box(&around, ray, *inverse, inverse.pad, end).is_some()
        };
        let rays = given.into_iter().filter(enters).collect();
        Problem { triangles, rays }
    }

    /// True if any hit is enough and there is one.
    fn is_answered(&self, ray: u32) -> bool {
        self.any && self.hits[ray as usize].triangle != NO_HIT
    }

    /// Each ray of a problem against each of its triangles. CPU version of `test_all`.
    fn answer(&mut self, soup: &TriangleSoup, rays: &[Ray], problem: &Problem) {
        for &index in &problem.rays {
            let ray = &rays[index as usize];
            let inverse = soup.intersection.inverse(ray.direction);
            for &id in &problem.triangles {
                if self.is_answered(index) {
                    break;
                }
                let triangle = (&soup.records[id as usize], soup.masks.as_deref());
                intersect_triangle(triangle, ray, inverse, &mut self.hits[index as usize]);
                self.tests += 1;
            }
        }
    }
}

impl Problem {
    /// CPU version of `is_divisible`.
    fn is_divisible(&self, soup: &TriangleSoup, naive: usize) -> bool {
        let centres = around_centres(soup, &self.triangles);
        let apart = (0..3).any(|axis| centres.min[axis] < centres.max[axis]);
        self.triangles.len().min(self.rays.len()) > naive && apart
    }

    /// The triangles of both parts.
    fn halves(&self, soup: &TriangleSoup) -> [Vec<u32>; 2] {
        let cut = cut_of(&around_centres(soup, &self.triangles));
        let is_first = |id: &u32| {
            let centre = soup.records[*id as usize].bounds().doubled_centre();
            centre[cut.axis] <= cut.position
        };
        let (first, second) = self.triangles.iter().partition(|id| is_first(id));
        [first, second]
    }
}

fn around(soup: &TriangleSoup, triangles: &[u32]) -> Bounds {
    let boxes = triangles
        .iter()
        .map(|id| soup.records[*id as usize].bounds());
    boxes.fold(Bounds::EMPTY, |all, one| all.union(&one))
}

fn around_centres(soup: &TriangleSoup, triangles: &[u32]) -> Bounds {
    let centres = triangles
        .iter()
        .map(|id| soup.records[*id as usize].bounds().doubled_centre());
    centres.fold(Bounds::EMPTY, |all, c| {
        all.union(&Bounds { min: c, max: c })
    })
}

/// CPU version of `cut_of`.
fn cut_of(centres: &Bounds) -> Cut {
    let extent = centres.extent();
    let mut axis = 0;
    for other in [1, 2] {
        if extent[other] > extent[axis] {
            axis = other;
        }
    }
    let (low, high) = (centres.min[axis], centres.max[axis]);
    let middle = 0.5 * low + 0.5 * high;
    let position = if middle < high { middle } else { low };
    Cut { axis, position }
}
