//! Refitting: new boxes for moved triangles in an unchanged tree; on the host and on the device,
//! bit-identical.
//!
//! The entries below a node are a range of [`Tree::order`] for any builder. So the device computes
//! boxes as in a radix tree: blocks of leaves, and each range from some of them (`blocks.wesl`,
//! `inner.wesl`). The host works from the leaves up.

use super::boxes::{OrderedBox, join};
use super::check_coordinates;
use super::device::{Passes, failed, play};
use crate::tree::{NodeKind, Tree};
use crate::{AccelError, BuildLog, TriangleSoup};
use rayon::prelude::*;
use raystone_gpu::Recording;

impl Tree {
    /// Refits the boxes to moved triangles on the host. A split triangle counts with its whole box
    /// in each of its leaves.
    ///
    /// # Errors
    /// The triangles differ from the tree's, or a coordinate is too large or NaN.
    pub fn refit(&mut self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.check_triangles(soup)?;
        check_coordinates(soup)?;
        let listed = self.order.par_iter();
        let boxes: Vec<OrderedBox> = listed
            .map(|id| OrderedBox::from(&soup.records[*id as usize]))
            .collect();
        let mut found = vec![OrderedBox::NOTHING; self.nodes.len()];
        // Children come after their parents.
        for (index, node) in self.nodes.iter_mut().enumerate().rev() {
            found[index] = match node.kind {
                NodeKind::Leaf { first, count } => boxes[first as usize..(first + count) as usize]
                    .iter()
                    .fold(OrderedBox::NOTHING, |all, leaf| join(all, *leaf)),
                NodeKind::Inner { left, right } => {
                    join(found[left as usize], found[right as usize])
                }
            };
            node.bounds = found[index].into();
        }
        self.epo = None;
        Ok(())
    }

    /// [`Tree::refit`] on the device of `log`, which records the time; the boxes are read back.
    ///
    /// # Errors
    /// As [`Tree::refit`]; there is no device, or it reported an error.
    pub fn refit_on_device(
        &mut self,
        soup: &TriangleSoup,
        log: &mut BuildLog,
    ) -> Result<(), AccelError> {
        self.check_triangles(soup)?;
        if self.nodes.is_empty() {
            return Ok(());
        }
        let Some(gpu) = log.gpu().cloned() else {
            // Playing reports the missing device.
            return log.play(&Recording::new()).map(|_| ());
        };
        let ranges = log.phase("ranges", || self.ranges());
        let [leaves, nodes] = [self.order.len(), self.nodes.len()].map(|n| n as u32);
        let mut recording = Recording::new();
        let passes = log.phase("upload", || {
            let passes = Passes::new(&gpu, soup, [leaves, nodes])?;
            passes.boxes(&mut recording, soup.records.len() as u32)?;
            passes.leaves(
                &mut recording,
                &(&gpu.storage("order", &self.order)?).into(),
            )?;
            passes.fit(&mut recording, &(&gpu.storage("ranges", &ranges)?).into())?;
            Ok(passes)
        });
        let passes = passes.map_err(failed)?;
        play(&recording, log)?;
        let fitted = passes.nodes(soup, log)?;
        for (node, fitted) in self.nodes.iter_mut().zip(&fitted[self.order.len()..]) {
            node.bounds = fitted.around().into();
        }
        self.epo = None;
        Ok(())
    }

    fn check_triangles(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let needed = self.order.iter().map(|id| id + 1).max().unwrap_or(0);
        let found = soup.records.len();
        ensure!(
            needed as usize == found,
            "the tree lists triangles up to {needed}, and there are {found}: other ones need a new build"
        );
        Ok(())
    }

    /// First and last entry of the order below each node.
    fn ranges(&self) -> Vec<[u32; 2]> {
        let mut out = vec![[0; 2]; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            out[index] = match node.kind {
                NodeKind::Leaf { first, count } => [first, first + count - 1],
                NodeKind::Inner { left, right } => [out[left as usize][0], out[right as usize][1]],
            };
        }
        out
    }
}
