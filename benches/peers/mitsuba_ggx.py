"""wgray's models of rough metal and rough glass as Mitsuba BSDFs.

Mitsuba's `roughconductor` and `roughdielectric` have the same microfacet distribution, sampling and Fresnel formulas,
but the separable masking-shadowing function G = G1(wi) G1(wo) (Walter et al., "Microfacet Models for Refraction through
Rough Surfaces", EGSR 2007). These BSDFs use the height-correlated function (Heitz, "Understanding the Masking-Shadowing
Function in Microfacet-Based BRDFs", JCGT 3(2), 2014, equation 99) for reflection, and the separable function for refraction.
The distribution, sampling, Fresnel formulas and the integrator are Mitsuba's. Call `register` after setting the variant.
"""
import drjit as dr
import mitsuba as mi

CONDUCTOR, DIELECTRIC = "correlated_conductor", "correlated_dielectric"


def register():
    def distribution(props):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, float(props["alpha_u"]), float(props["alpha_v"]), True)

    def correlated_g2(distribution, a, b, m):
        """The height-correlated masking-shadowing function."""
        ga, gb = distribution.smith_g1(a, m), distribution.smith_g1(b, m)
        return dr.select((ga > 0) & (gb > 0), ga * gb / (ga + gb - ga * gb), 0)

    class Rough(mi.BSDF):
        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def to_string(self):
            return type(self).__name__

    class Conductor(Rough):
        """A one-sided metal. The reflectance is `color`, times the Fresnel reflectance for the complex index `eta` + i `k` if given."""

        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.distribution = distribution(props)
            self.color = props.get_texture("color")
            self.index = [mi.Complex2f(float(props[f"eta{i}"]), float(props[f"k{i}"])) for i in range(3)] if "eta0" in props else None
            self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def sample(self, ctx, si, which, at, active=True):
            m, _ = self.distribution.sample(si.wi, at)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta = mi.reflect(si.wi, m), 1
            bs.sampled_component, bs.sampled_type = mi.UInt32(0), mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            return bs, dr.select(active & (bs.pdf > 0), value / bs.pdf, 0)

        def eval_pdf(self, ctx, si, wo, active=True):
            active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
            m = dr.normalize(si.wi + wo)
            cosine = dr.dot(si.wi, m)
            fresnel = self.color.eval(si, active)
            if self.index:
                fresnel *= mi.Color3f(*(mi.fresnel_conductor(mi.Float(cosine), index) for index in self.index))
            value = fresnel * (self.distribution.eval(m) * correlated_g2(self.distribution, si.wi, wo, m) / (4 * mi.Frame3f.cos_theta(si.wi)))
            density = self.distribution.pdf(si.wi, m) / (4 * dr.dot(wo, m))
            return dr.select(active, value, 0), dr.select(active, density, 0)

    class Dielectric(Rough):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.distribution, self.ior = distribution(props), float(props["int_ior"])
            self.color = props.get_texture("color")
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [mi.BSDFFlags.GlossyReflection | sides, mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.NonSymmetric | sides]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def sample(self, ctx, si, which, at, active=True):
            m, _ = self.distribution.sample(dr.mulsign(si.wi, mi.Frame3f.cos_theta(si.wi)), at)
            reflected, cosine, eta, inverse = mi.fresnel(dr.dot(si.wi, m), mi.Float(self.ior))
            mirrors = which <= reflected
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = dr.select(mirrors, mi.reflect(si.wi, m), mi.refract(si.wi, m, cosine, inverse))
            bs.eta = dr.select(mirrors, 1, eta)
            bs.sampled_component = dr.select(mirrors, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(mirrors, mi.UInt32(+mi.BSDFFlags.GlossyReflection), mi.UInt32(+mi.BSDFFlags.GlossyTransmission))
            active &= mirrors == (mi.Frame3f.cos_theta(si.wi) * mi.Frame3f.cos_theta(bs.wo) > 0)
            value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            return bs, dr.select(active & (bs.pdf > 0), value / bs.pdf, 0)

        def eval_pdf(self, ctx, si, wo, active=True):
            i, o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            active &= (i != 0) & (o != 0)
            mirrors = i * o > 0
            eta = dr.select(i > 0, self.ior, 1 / self.ior)
            m = dr.normalize(si.wi + wo * dr.select(mirrors, 1, eta))
            m = dr.mulsign(m, mi.Frame3f.cos_theta(m))
            to_i, to_o = dr.dot(si.wi, m), dr.dot(wo, m)
            active &= (to_i * i > 0) & (to_o * o > 0)
            d = self.distribution.eval(m)
            reflected = mi.fresnel(to_i, mi.Float(self.ior))[0]
            separable = self.distribution.smith_g1(si.wi, m) * self.distribution.smith_g1(wo, m)
            bend = (to_i + eta * to_o) ** 2
            mirrored = reflected * d * correlated_g2(self.distribution, si.wi, wo, m) / (4 * dr.abs(i))
            # In radiance transport, the factor eta^2 of the BTDF cancels against 1/eta^2, so the formula has neither factor.
            refracted = (1 - reflected) * d * separable * dr.abs(to_i * to_o / (i * bend))
            value = dr.select(mirrors, mi.Color3f(mirrored), self.color.eval(si, active) * refracted)
            visible = self.distribution.pdf(dr.mulsign(si.wi, i), m)
            density = visible * dr.select(mirrors, reflected / (4 * dr.abs(to_o)), (1 - reflected) * eta * eta * dr.abs(to_o) / bend)
            return dr.select(active, value, 0), dr.select(active, density, 0)

    mi.register_bsdf(CONDUCTOR, Conductor)
    mi.register_bsdf(DIELECTRIC, Dielectric)
