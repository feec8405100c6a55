#include "render/surface/four_surfaces.h"

#include <gtest/gtest.h>

#include <random>

namespace vlx::render {
namespace {

/// A surface, and what is asked of it.
struct Question {
    SurfaceParameters surface;
    Vec3 wo, up, wi;
    bool fromBehind = false;
    Vec2 direction;
    float choice = 0;
};

class Questions {
  public:
    explicit Questions(bool layered) : layered_(layered) {}

    Question next() {
        Question q;
        SurfaceParameters& s = q.surface;
        s.albedoTable = &table_;
        s.baseColour = {number(), number(), number()};
        s.metallic = oneOf({0, 0, 1, number()});
        s.roughness = oneOf({0, 1, number(), number()});
        s.retro = number() < 0.3f;
        s.specular = oneOf({0, 1, number()});
        s.specularColour = {number(), number(), number()};
        if (layered_) {
            s.transmission = oneOf({0, 0, 1, number()});
            s.clearcoat = oneOf({0, 0, 1, number()});
            s.clearcoatRoughness = oneOf({0, 1, number()});
            if (number() < 0.3f) s.sheenColour = {number(), number(), number()};
            s.sheenRoughness = number();
            s.sheenTable = {&sheen_};
            if (number() < 0.8f) s.glassTable = {&glass_};
        }
        q.wo = direction(oneOf({1e-3f, 1, number()}));
        q.up = number() < 0.5f ? Vec3{0, 0, 1} : direction(0.3f + 0.7f * number());
        q.wi = direction(2 * number() - 1);
        q.fromBehind = number() < 0.5f;
        q.direction = {number(), number()};
        q.choice = number();
        return q;
    }

  private:
    float number() { return static_cast<float>(random_() >> 40) * 0x1p-24f; }
    float oneOf(std::initializer_list<float> values) { return values.begin()[random_() % values.size()]; }
    Vec3 direction(float cosine) {
        const float sine = std::sqrt(std::max(0.f, 1 - cosine * cosine)), phi = 2 * kPi * number();
        return {sine * std::cos(phi), sine * std::sin(phi), cosine};
    }

    std::mt19937_64 random_{5};
    AlbedoTable table_{1.5f};
    GlassTable glass_{1.5f};
    SheenTable sheen_;
    bool layered_;
};

template <Features F>
void expectBitsOfEach() {
    Questions questions(F.layers);
    const AlbedoTable coat(1.5f);
    std::array<int, 2> found{};  // paths that end, and that go on
    for (int k = 0; k < 5000; ++k) {
        const std::array<Question, kLanes> q = {questions.next(), questions.next(), questions.next(),
                                                questions.next()};
        const FourSurfaces<F> surfaces([&](std::size_t i) { return q[i].surface; });
        const BasicBsdf<F, Lanes> four(*surfaces, vectorsOf([&](std::size_t i) { return q[i].wo; }),
                                       maskOf([&](std::size_t i) { return q[i].fromBehind; }), coat,
                                       vectorsOf([&](std::size_t i) { return q[i].up; }));
        const auto values = four.evaluate(vectorsOf([&](std::size_t i) { return q[i].wi; }));
        const auto samples = four.sample({lanesOf([&](std::size_t i) { return q[i].direction.x; }),
                                          lanesOf([&](std::size_t i) { return q[i].direction.y; })},
                                         lanesOf([&](std::size_t i) { return q[i].choice; }));
        for (std::size_t i = 0; i < kLanes; ++i) {
            const BasicBsdf<F> one(q[i].surface, q[i].wo, q[i].fromBehind, coat, q[i].up);
            EXPECT_EQ(lane(four.albedo(), i), one.albedo());
            EXPECT_EQ(four.hasSmoothLobe()[i] != 0, one.hasSmoothLobe());
            const BsdfValue f = one.evaluate(q[i].wi), wide = lane(values, i);
            EXPECT_EQ(wide.value, f.value);
            EXPECT_EQ(wide.pdf, f.pdf);
            const BsdfSample s = one.sample(q[i].direction, q[i].choice), t = lane(samples, i);
            EXPECT_EQ(t.weight, s.weight);
            ++found[isBlack(s.weight) ? 0 : 1];
            if (isBlack(s.weight)) continue;
            EXPECT_EQ(t.wi, s.wi);
            EXPECT_EQ(t.pdf, s.pdf);
            EXPECT_EQ(t.delta, s.delta);
            EXPECT_EQ(t.coat, s.coat);
            EXPECT_EQ(t.through, s.through);
            EXPECT_EQ(t.folded, s.folded);
        }
        if (testing::Test::HasFailure()) return;
    }
    EXPECT_GT(found[0], 100);
    EXPECT_GT(found[1], 10000);
}

TEST(FourSurfaces, GiveTheBitsOfEachThatReflects) { expectBitsOfEach<kReflecting>(); }
TEST(FourSurfaces, GiveTheBitsOfEachWithLayersAndGlass) { expectBitsOfEach<kLayered>(); }
TEST(FourSurfaces, GiveTheBitsOfEachThatIsMatte) { expectBitsOfEach<kMatte>(); }

}  // namespace
}  // namespace vlx::render
