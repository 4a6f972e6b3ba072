class Principled(Opaque):
    distribution = mi.MicrofacetType.GGX

    def alpha(self):
        return max(self.numbers[1] ** 2, 0.001)

    def reflected(self, base, wi, wo):
        metallic, roughness, f0 = self.numbers[:3]
        squared = self.alpha() ** 2
        h = dr.normalize(wi + wo)
        cosine = dr.dot(wi, h)
        d = squared / (dr.pi * (h.z * h.z * (squared - 1) + 1) ** 2)

        def shadow(c):
            return 0.5 * (dr.sqrt(1 + squared * (1 - c * c) / (c * c)) - 1)

        facets = d / (1 + shadow(wi.z) + shadow(wo.z)) / (4 * wi.z)
        energy = 1 - roughness * (1 - 1 / 1.51)
        bend = roughness / 2 + 2 * roughness * cosine * cosine - 1
        diffuse = base * (dr.inv_pi * energy * (1 + bend * (1 - wo.z) ** 5) * (1 + bend * (1 - wi.z) ** 5))
        through = (1 - schlick(f0, wi.z)) * (1 - schlick(f0, wo.z))
        plain = through * diffuse * wo.z + schlick(f0, cosine) * facets
        return (1 - metallic) * plain + metallic * schlick(base, cosine) * facets


mi.register_bsdf("raystone-principled", Principled)
