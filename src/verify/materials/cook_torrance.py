class CookTorrance(Opaque):
    distribution = mi.MicrofacetType.Beckmann

    def alpha(self):
        return self.numbers[3]

    def masking(self, cosine):
        tangent = dr.safe_sqrt(1 - cosine * cosine) / cosine
        a = 1 / (self.numbers[3] * dr.maximum(tangent, 1e-20))
        return dr.select(a < 1.6, (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a), 1)

    def reflected(self, base, wi, wo):
        m, eta, smith, exact = self.numbers[3:7]
        h = dr.normalize(wi + wo)
        cosine = dr.dot(wi, h)
        squared = h.z * h.z
        d = dr.exp(-(1 - squared) / (squared * m * m)) / (dr.pi * m * m * squared * squared)
        if smith > 0:
            g = self.masking(wi.z) * self.masking(wo.z)
        else:
            g = dr.minimum(1, 2 * h.z * dr.minimum(wi.z, wo.z) / cosine)
        f = fresnel(cosine, eta) if exact > 0 else schlick(((eta - 1) / (eta + 1)) ** 2, cosine)
        return base * dr.inv_pi * wo.z + mi.Color3f(*self.numbers[:3]) * (f * g * d / (4 * wi.z))


mi.register_bsdf("raystone-cook-torrance", CookTorrance)
