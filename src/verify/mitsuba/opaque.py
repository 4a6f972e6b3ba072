"""Materials of Raystone that Mitsuba 3 has no counterpart of, for images that can be compared.

Import this after mitsuba.set_variant(…) and before mitsuba.load_file(…). Written from the formulas of Raystone's docs/shading.md; the
densities are others, which no mean depends on.
"""

import drjit as dr
import mitsuba as mi


def fresnel(cosine, eta):
    """Fresnel's equations for unpolarised light from outside of a body of index eta."""
    refracted = dr.safe_sqrt(1 - (1 - cosine * cosine) / (eta * eta))
    parallel = (eta * cosine - refracted) / (eta * cosine + refracted)
    across = (cosine - eta * refracted) / (cosine + eta * refracted)
    return 0.5 * (parallel * parallel + across * across)


def schlick(f0, cosine):
    return f0 + (1 - f0) * (1 - cosine) ** 5


class Opaque(mi.BSDF):
    """A surface that looks the same from both sides. Directions are drawn from a cosine and from facets, half each."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.base = props.get_texture("base", 0.5)
        self.numbers = [props.get(f"p{k}", 0.0) for k in range(8)]
        flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [flags]
        self.m_flags = flags

    def facets(self):
        return mi.MicrofacetDistribution(self.distribution, self.alpha(), False)

    @staticmethod
    def upright(si, wo):
        """Both directions on the side of the viewer."""
        wi = mi.Vector3f(si.wi)
        below = wi.z < 0
        wi.z = dr.abs(wi.z)
        wo = mi.Vector3f(wo)
        wo.z = dr.select(below, -wo.z, wo.z)
        return wi, wo

    def density(self, wi, wo):
        h = dr.normalize(wi + wo)
        facets = self.facets().pdf(wi, h) / (4 * dr.maximum(dr.dot(wo, h), 1e-20))
        pdf = 0.5 * mi.warp.square_to_cosine_hemisphere_pdf(wo) + 0.5 * facets
        return dr.select((wi.z > 0) & (wo.z > 0), pdf, 0)

    def value(self, si, wi, wo, active):
        f = self.reflected(self.base.eval(si, active), wi, wo)
        return dr.select((wi.z > 0) & (wo.z > 0), f, mi.Color3f(0))

    def eval(self, ctx, si, wo, active=True):
        wi, wo = self.upright(si, wo)
        return self.value(si, wi, wo, active) & active

    def pdf(self, ctx, si, wo, active=True):
        wi, wo = self.upright(si, wo)
        return dr.select(active, self.density(wi, wo), 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def sample(self, ctx, si, sample1, sample2, active=True):
        wi, _ = self.upright(si, si.wi)
        h, _ = self.facets().sample(wi, sample2)
        wo = dr.select(sample1 < 0.5, mi.warp.square_to_cosine_hemisphere(sample2), mi.reflect(wi, h))
        pdf = self.density(wi, wo)
        good = active & (pdf > 0)
        weight = dr.select(good, self.value(si, wi, wo, good) / pdf, 0)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.Vector3f(wo)
        bs.wo.z = dr.select(si.wi.z < 0, -wo.z, wo.z)
        bs.pdf = dr.select(good, pdf, 0)
        bs.eta = 1
        bs.sampled_type = mi.UInt32(+self.m_flags)
        bs.sampled_component = 0
        return bs, weight

    def to_string(self):
        return f"{type(self).__name__}[{self.numbers}]"


