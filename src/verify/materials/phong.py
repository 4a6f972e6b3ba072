class Phong(Opaque):
    distribution = mi.MicrofacetType.Beckmann

    def alpha(self):
        return min(max((2 / (self.numbers[3] + 2)) ** 0.5, 0.01), 1.0)

    def reflected(self, base, wi, wo):
        exponent = self.numbers[3]
        mirrored = mi.Vector3f(-wi.x, -wi.y, wi.z)
        lobe = (exponent + 1) * dr.inv_two_pi * dr.maximum(dr.dot(wo, mirrored), 0) ** exponent
        return base * dr.inv_pi * wo.z + mi.Color3f(*self.numbers[:3]) * lobe


mi.register_bsdf("raystone-phong", Phong)
