//! The node around several. CPU version of `kernels/accel/ray_hierarchy/enclosing.wesl`.

use super::node::{Bounding, Node, axis_of_sum, empty_around, grown, inflated, no_rays, pair};

/// The node around `children`, which are overwritten: at once around the middle of all balls and the
/// sum of all axes, or in pairs, ((0, 1), (2, 3)) and so on, as in D. Roger's thesis (2008), section
/// 3.3. At once needs no trigonometry, and a single child is the node itself.
pub(crate) fn enclosing(children: &mut [Node], pairwise: bool, bounding: &Bounding) -> Node {
    if pairwise {
        let mut apart = 1;
        while apart < children.len() {
            for k in (0..children.len() - apart).step_by(2 * apart) {
                children[k] = pair(&children[k], &children[k + apart], bounding);
            }
            apart *= 2;
        }
        return children[0];
    }
    let (mut low, mut high, mut sum) = ([3.0e38_f32; 3], [-3.0e38_f32; 3], [0.0_f32; 3]);
    let (mut held, mut only) = (0, no_rays());
    for child in children.iter().filter(|child| child.radius >= 0.0) {
        for a in 0..3 {
            low[a] = low[a].min(child.centre[a] - child.radius);
            high[a] = high[a].max(child.centre[a] + child.radius);
            sum[a] += child.axis[a];
        }
        held += 1;
        only = *child;
    }
    if held < 2 {
        return only;
    }
    let middle = std::array::from_fn(|a| 0.5 * low[a] + 0.5 * high[a]);
    let around = empty_around(middle, axis_of_sum(sum));
    inflated(children.iter().fold(around, grown), bounding)
}
