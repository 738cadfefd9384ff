"""The Phong BRDF as a Mitsuba BSDF: f = kd / pi + ks (n + 2) / (2 pi) cos^n alpha.

alpha is the angle to the mirror direction. Call `register` after setting the variant; it returns the plugin's name. A
lobe is selected with a probability proportional to the mean of kd or ks. The BSDF is one-sided: wrap it in Mitsuba's `twosided`.
"""
import drjit as dr
import mitsuba as mi

NAME = "phong_lobe"


def register():
    class Phong(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.kd, self.ks = props.get_texture("kd"), props.get_texture("ks")
            self.power = float(props["shininess"])
            side = mi.BSDFFlags.FrontSide
            self.m_components = [mi.BSDFFlags.GlossyReflection | side, mi.BSDFFlags.DiffuseReflection | side]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def to_string(self):
            return f"Phong[{self.power}]"

        def glossy_probability(self, si, active):
            """Returns the probability of the glossy lobe."""
            diffuse, glossy = dr.mean(self.kd.eval(si, active)), dr.mean(self.ks.eval(si, active))
            return dr.select(diffuse + glossy > 0, glossy / (diffuse + glossy), 0)

        def lobe(self, si, wo):
            """Returns cos^n alpha."""
            cosine = dr.maximum(dr.dot(mi.reflect(si.wi), wo), 0)
            return dr.select(cosine > 0, cosine ** self.power, 0)

        def sample(self, ctx, si, which, at, active=True):
            glossy = which < self.glossy_probability(si, active)
            cosine = at.x ** (1 / (self.power + 1))
            sine = dr.safe_sqrt(1 - cosine * cosine)
            s, c = dr.sincos(2 * dr.pi * at.y)
            mirrored = mi.Frame3f(mi.reflect(si.wi)).to_world(mi.Vector3f(sine * c, sine * s, cosine))
            wo = dr.select(glossy, mirrored, mi.warp.square_to_cosine_hemisphere(at))
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta = wo, 1
            bs.sampled_component = dr.select(glossy, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(glossy, mi.UInt32(+mi.BSDFFlags.GlossyReflection), mi.UInt32(+mi.BSDFFlags.DiffuseReflection))
            value, bs.pdf = self.eval_pdf(ctx, si, wo, active)
            active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (bs.pdf > 0)
            return bs, dr.select(active, value / bs.pdf, 0)

        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx, si, wo, active=True):
            cosine = mi.Frame3f.cos_theta(wo)
            active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (cosine > 0)
            lobe, n, probability = self.lobe(si, wo), self.power, self.glossy_probability(si, active)
            value = self.kd.eval(si, active) * dr.inv_pi + self.ks.eval(si, active) * ((n + 2) * lobe / (2 * dr.pi))
            density = probability * (n + 1) * lobe / (2 * dr.pi) + (1 - probability) * cosine * dr.inv_pi
            return dr.select(active, value * cosine, 0), dr.select(active, density, 0)

        def eval_diffuse_reflectance(self, si, active=True):
            return self.kd.eval(si, active)

    mi.register_bsdf(NAME, Phong)
    return NAME
