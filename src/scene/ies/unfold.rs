//! Completes the horizontal angles of luminaires by symmetry.

use super::parse::{SAME, is};
use super::{IesProfile, Photometry};

impl IesProfile {
    /// Completes the horizontal angles, which end in `line`, by symmetry.
    pub(super) fn unfold(&mut self, line: usize) -> Result<(), String> {
        let [first, last] = [
            self.horizontal[0],
            self.horizontal[self.horizontal.len() - 1],
        ];
        let unknown =
            || format!("horizontal angles from {first} to {last} are none of the standard");
        if self.photometry != Photometry::C {
            if self.horizontal.len() == 1 {
                self.warnings.push(format!(
                    "{}, line {line}: there is one horizontal angle, {first}; its intensities are taken for all",
                    self.name
                ));
                self.horizontal = vec![-90.0, 90.0];
                self.candela.extend_from_within(..);
                return Ok(());
            }
            // Narrow beams are measured as far as they go.
            let is_known = last > 0.0 && last <= 90.0 + SAME;
            return match is_known {
                true if is(first, -last) => Ok(()),
                true if is(first, 0.0) => {
                    self.mirror(0.0);
                    Ok(())
                }
                _ => Err(unknown()),
            };
        }
        match (first, last) {
            _ if self.horizontal.len() == 1 => Ok(()),
            _ if is(first, 0.0) && is(last, 90.0) => {
                self.mirror(90.0);
                self.mirror(180.0);
                Ok(())
            }
            _ if is(last - first, 180.0) && (is(first, 0.0) || is(first, 180.0)) => {
                self.mirror(180.0);
                Ok(())
            }
            _ if is(last - first, 180.0) && (is(first, -90.0) || is(first, 90.0)) => {
                self.mirror(last);
                self.turn_to_zero();
                Ok(())
            }
            _ if is(first, -180.0) && is(last, 180.0) => {
                self.turn_to_zero();
                Ok(())
            }
            _ if is(first, 0.0) && is(last, 360.0) => Ok(()),
            _ if is(first, 0.0) && last > 180.0 && last < 360.0 => {
                let gap = 360.0 - last;
                let step = last - self.horizontal[self.horizontal.len() - 2];
                if gap > 1.5 * step {
                    return Err(unknown());
                }
                self.warnings.push(format!(
                    "{}, line {line}: the horizontal angle 360 is missing, and taken to be that of 0",
                    self.name
                ));
                self.horizontal.push(360.0);
                self.candela.extend_from_within(..self.vertical.len());
                Ok(())
            }
            _ => Err(unknown()),
        }
    }

    /// Adds the other angles, mirrored at the first or last one, `about`.
    fn mirror(&mut self, about: f32) {
        let rows = self.vertical.len();
        let columns: Vec<(f32, Vec<f32>)> = self
            .horizontal
            .iter()
            .zip(self.candela.chunks(rows))
            .map(|(h, column)| (*h, column.to_vec()))
            .collect();
        let others = columns.iter().filter(|(h, _)| !is(*h, about));
        let mut all: Vec<_> = others
            .map(|(h, column)| (2.0 * about - h, column.clone()))
            .collect();
        all.extend(columns.iter().cloned());
        self.set_columns(all);
    }

    /// Maps angles to 0 to 360, and completes these two.
    fn turn_to_zero(&mut self) {
        let rows = self.vertical.len();
        let turned = |h: f32| match h {
            _ if h > 360.0 + SAME => h - 360.0,
            _ if h < -SAME => h + 360.0,
            _ => h,
        };
        let columns = self.horizontal.iter().zip(self.candela.chunks(rows));
        let mut all: Vec<(f32, Vec<f32>)> = columns
            .map(|(h, column)| (turned(*h), column.to_vec()))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.dedup_by(|a, b| is(a.0, b.0));
        let [(low, first), (high, last)] = [&all[0], &all[all.len() - 1]];
        let at_zero = match (is(*low, 0.0), is(*high, 360.0)) {
            (true, _) => first.clone(),
            (_, true) => last.clone(),
            // Not measured: its neighbours are interpolated.
            _ => {
                let [a, b] = [360.0 - high, *low];
                let pairs = last.iter().zip(first);
                pairs.map(|(x, y)| (x * b + y * a) / (a + b)).collect()
            }
        };
        all.retain(|(h, _)| !is(*h, 0.0) && !is(*h, 360.0));
        all.extend([(0.0, at_zero.clone()), (360.0, at_zero)]);
        self.set_columns(all);
    }

    fn set_columns(&mut self, mut columns: Vec<(f32, Vec<f32>)>) {
        columns.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.horizontal = columns.iter().map(|(h, _)| *h).collect();
        self.candela = columns.into_iter().flat_map(|(_, column)| column).collect();
    }
}
