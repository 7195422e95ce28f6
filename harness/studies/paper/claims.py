"""The paper's testable sentences in its order, each with what decides it."""

from collections.abc import Mapping
from types import MappingProxyType

from harness.studies.paper import claims_of_geometry as g
from harness.studies.paper import claims_of_simulations as s
from harness.studies.paper import claims_of_the_law as f
from harness.studies.paper import claims_of_the_manifold as m
from harness.studies.paper.ledger import Claim, FlownClaim, TheoryClaim

CLAIMS: Mapping[str, tuple[Claim, ...]] = MappingProxyType(
    {
        "Abstract and introduction": (
            FlownClaim(
                "0a",
                "The loitering algorithm steers the UAV to circle a moving target at the desired distance, by "
                "heading alone",
                f.circles_a_moving_target,
            ),
            FlownClaim(
                "0b",
                "With the linear manifold of general SMC the error converges to zero, but not in finite time",
                f.smc_takes_for_ever,
            ),
        ),
        "2.1 UAV dynamic model": (
            FlownClaim(
                "2.1a",
                "A flight control system accurately tracks velocity and turn-rate commands, at constant altitude",
                f.tracks_its_commands,
            ),
            FlownClaim(
                "2.1b",
                "Where v_a and ψ_a cannot be had, Eq. (1) can be rewritten in ground speed and course",
                f.flies_by_course,
            ),
            FlownClaim(
                "2.1c", "The coordinated flight model captures the dynamics of manoeuvring flight", f.coordinated
            ),
            TheoryClaim(
                "2.1d",
                "v_g follows from v_a, χ_a and the wind by the relation above Eq. (3)",
                g.ground_speed_relation_numbers,
                g.ground_speed_relation,
            ),
            TheoryClaim("2.1e", "Eq. (3): χ̇_a = L(ψ_a) ω_ψ", g.course_rate_relation_numbers, g.course_rate_relation),
            TheoryClaim("2.1f", "Without wind L = 1", g.no_wind_ratio_numbers, g.no_wind_ratio),
            TheoryClaim("2.1g", "L ∈ (1/2, 1] for wind below v_a", g.ratio_range_numbers, g.ratio_range),
        ),
        "2.2 Relative motion": (
            TheoryClaim(
                "2.2a",
                "The EKF of Eq. (4) estimates the target's motion",
                g.estimator_consistent_numbers,
                g.estimator_consistent,
            ),
            TheoryClaim("2.2b", "Eq. (5), first line: ṙ", g.range_rate_numbers, g.range_rate),
            TheoryClaim(
                "2.2c",
                "Eq. (5), second line, as printed: λ̇",
                g.azimuth_rate_as_printed_numbers,
                g.azimuth_rate_as_printed,
            ),
            FlownClaim("2.2d", "A target faster than the UAV may flee", f.faster_target_flees),
            FlownClaim("2.2e", "Remark 1: 0 ≤ v_t + v_w < v_a avoids task failure", f.remark_1_is_enough),
            FlownClaim("2.2f", "Definition 1: r → 0, ṙ → 0, r ṙ ≤ 0", f.definition_1),
        ),
        "3.1 Loitering algorithm": (
            TheoryClaim(
                "3.1a", "Eq. (7): at ψ̄_a = ψ̄_a^d the distance is steady", g.desired_heading_numbers, g.desired_heading
            ),
            TheoryClaim(
                "3.1b",
                "Eq. (8): ṙ by the heading error",
                g.range_rate_by_heading_error_numbers,
                g.range_rate_by_heading_error,
            ),
            TheoryClaim(
                "3.1c",
                "Remark 2: cos((ψ̄_a + ψ̄_a^d)/2) > 0 for both in (−π/2, π/2]",
                g.remark_2_cosine_numbers,
                g.remark_2_cosine,
            ),
            TheoryClaim(
                "3.1d",
                "Remark 2: ṙ r ≤ 0 is equivalent to ψ̃_a r ≤ 0",
                g.remark_2_equivalence_numbers,
                g.remark_2_equivalence,
            ),
            TheoryClaim(
                "3.1e",
                "Eq. (9), (10): ψ̃_a = −arctan(c r) drives r to zero",
                g.arctan_manifold_numbers,
                g.arctan_manifold,
            ),
            TheoryClaim(
                "3.1f",
                "The starts of Section 4.1 (30°, 130°) lie where the theory holds",
                g.starts_in_the_regions_numbers,
                g.starts_in_the_regions,
            ),
            FlownClaim("3.1g", "λ is free: the UAV flies round a slower target", f.goes_round),
            FlownClaim("3.1h", "The UAV follows behind the target at the desired distance", f.follows_behind),
        ),
        "3.2 Sliding manifold": (
            TheoryClaim("3.2a", "(i) β1 = 1: exponentially stable", m.exponential_mode_numbers, m.exponential_mode),
            TheoryClaim("3.2b", "(ii) 0 < β1 < 1: finite time", m.terminal_mode_numbers, m.terminal_mode),
            TheoryClaim(
                "3.2c", "(iii) β1 > 1: fast far from the origin, slow close to it", m.steep_mode_numbers, m.steep_mode
            ),
            TheoryClaim(
                "3.2d",
                "(iii) The convergence rate is inversely proportional to the distance from zero",
                m.rate_over_distance_numbers,
                m.rate_over_distance,
            ),
            TheoryClaim(
                "3.2e",
                "For fixed β1 the convergence rate rises with α1",
                m.monotone_in_alpha_numbers,
                m.monotone_in_alpha,
            ),
            TheoryClaim("3.2f", "Remark 3: T_TSM", m.remark_3_numbers, m.remark_3),
            TheoryClaim("3.2g", "Figure 3: the FTSM converges faster than the TSM", m.figure_3_numbers, m.figure_3),
            TheoryClaim(
                "3.2h",
                "Far from the equilibrium the α2 term dominates, close to it the α3 term",
                m.dominance_numbers,
                m.dominance,
            ),
            TheoryClaim(
                "3.2i",
                "When α2 = 0 the FTSM is equal to the TSM",
                m.without_the_fast_term_numbers,
                m.without_the_fast_term,
            ),
            TheoryClaim("3.2j", "Remark 4 as printed: T_FTSM", m.remark_4_numbers, m.remark_4),
            TheoryClaim(
                "3.2k", "The three special values of F(·)", m.hypergeometric_examples_numbers, m.hypergeometric_examples
            ),
            TheoryClaim("3.2l", "TSM and FTSM are singular at x = 0", m.singular_tsm_numbers, m.singular_tsm),
            TheoryClaim(
                "3.2m", "The NFTSM manifold of Definition 5 is nonsingular", m.nonsingular_numbers, m.nonsingular
            ),
            TheoryClaim(
                "3.2n", "Its time derivative, Eq. (16), is continuous", m.continuous_slope_numbers, m.continuous_slope
            ),
        ),
        "3.3 and 3.4 Guidance law and stability": (
            TheoryClaim(
                "3.3a", "Eq. (19) makes s follow the reaching law, Eq. (18)", g.reaching_law_numbers, g.reaching_law
            ),
            TheoryClaim(
                "3.3b", "Eq. (20) as printed: the rate of ψ̄_a^d", g.desired_heading_rate_numbers, g.desired_heading_rate
            ),
            TheoryClaim("3.4a", "Lemma 1, Eq. (22)", m.lemma_1_numbers, m.lemma_1),
            FlownClaim("3.4b", "Eq. (23): V̇1 ≤ 0", f.v1_falls),
            TheoryClaim("3.4c", "Eq. (25) bounds the reaching time", m.reaching_bound_numbers, m.reaching_bound),
            FlownClaim("3.4d", "The sliding manifold is reached within Eq. (25)'s time", f.eq_25_bounds_the_flight),
            TheoryClaim(
                "3.4e",
                "Eq. (28): α2 (π/2)^β2 + α3 (π/2)^β3 ≤ π is a reasonable condition on Table 2",
                m.eq_28_numbers,
                m.eq_28,
            ),
            TheoryClaim("3.4f", "Eq. (29): ψ̄_a^d ≤ arcsin ξ", g.eq_29_numbers, g.eq_29),
            TheoryClaim("3.4g", "Eq. (30): |ψ̄_a| stays below π/2 on the manifold", m.eq_30_numbers, m.eq_30),
            TheoryClaim("3.4h", "Eq. (31): V̇2 ≤ 0 on the manifold", m.eq_31_numbers, m.eq_31),
            TheoryClaim("3.4i", "Eq. (32), (33): |ψ̃_a| ≤ α2 η^β2 + α3 η^β3 within η", m.eq_33_numbers, m.eq_33),
            TheoryClaim(
                "3.4j",
                "Theorem 1: on the manifold r converges to zero in finite time",
                m.finite_time_scalar_numbers,
                m.finite_time_scalar,
            ),
            FlownClaim("3.4k", "Theorem 1, in flight", f.reaches_zero),
        ),
        "4 Simulation results: sampling": (
            FlownClaim("4a", "Table 1's sampling time of 0.5 s serves NFTSM (fitted gains)", f.nftsm_sampling),
            FlownClaim("4b", "… NFTSM_1", f.nftsm_1_sampling),
            FlownClaim("4c", "… NFTSM with the printed gains", f.printed_sampling),
            FlownClaim("4d", "… SMC", f.smc_sampling),
        ),
        "4.1 Stationary target": (
            FlownClaim("4.1a", "All three laws steer the UAV to circle the target, from 30°", s.all_circle),
            FlownClaim("4.1b", "NFTSM converges faster than SMC", s.nftsm_is_faster),
            FlownClaim("4.1c", "There is an overshoot when α2 and β2 are enlarged", s.larger_gains_overshoot),
            FlownClaim("4.1d", "From 130° SMC takes long, NFTSM is there sooner", s.slower_from_130),
            FlownClaim("4.1e", "NFTSM's heading rate is restricted from 8 s to 17 s", s.restricted_8_to_17),
            FlownClaim("4.1f", "NFTSM needs a strong mobility, SMC changes slowly", s.mobility),
            FlownClaim("4.1g", "All three hold the circle without divergence, from 30°", s.they_stay),
            FlownClaim("4.1h", "Table 3, six rows (NFTSM with the fitted gains)", s.table_3),
            FlownClaim("4.1i", "Table 3, NFTSM's two rows with the gains of Table 2", s.table_3_as_printed),
        ),
        "4.2 Constant speed target": (
            FlownClaim("4.2a", "Round the S, NFTSM converges faster than SMC", s.faster_round_the_s),
            FlownClaim("4.2b", "SMC adjusts its heading slowly compared with NFTSM", s.slow_adjustment),
            FlownClaim("4.2c", "NFTSM_1's overshoot exists at the start and improves after 75 s", s.overshoot_improves),
            FlownClaim("4.2d", "All three converge to zero in finite time, in 2000 s", s.all_converge_in_2000_s),
            FlownClaim("4.2e", "38.8 s, 81.6 s, 0.18 m", s.numbers_of_4_2),
        ),
        "4.3 Manoeuvring target": (
            FlownClaim(
                "4.3a",
                "The UAV circles the slow target and follows the fast one behind a distance",
                s.circles_then_follows,
            ),
            FlownClaim("4.3b", "Adjustments are particularly evident in the sharp turn", s.adjusts_in_turns),
            FlownClaim("4.3c", "All three converge to the desired position as speed and heading change", s.all_return),
            FlownClaim("4.3d", "24.3 s, 34.2 s, 113.6 s; 17.4 m, 10.3 s, ±0.1 m", s.numbers_of_4_3),
            FlownClaim(
                "4.3e",
                "While the target accelerates only SMC has a large error, NFTSM and NFTSM_1 are stable",
                s.only_smc_is_off,
            ),
            FlownClaim("4.3f", "After 350 s SMC gradually comes close to zero", s.smc_comes_back),
            FlownClaim(
                "4.3g", "SMC's larger error is at 460 s, with high acceleration and a sharp turn", s.larger_at_460
            ),
            FlownClaim("4.3h", "SMC's error is close to zero in the turn at 550 s", s.small_at_550),
            FlownClaim(
                "4.3i", "SMC is sensitive to the target's speed and insensitive to its angle", s.sensitive_to_speed
            ),
            FlownClaim("4.3j", "NFTSM_1 shows the opposite", s.nftsm_1_is_sensitive_to_turns),
            FlownClaim("4.3k", "NFTSM keeps the error within ±0.1 m", s.within_0_1_m),
            FlownClaim("4.3l", "NFTSM is more sensitive to angle than to speed", s.more_sensitive_to_turns),
            FlownClaim(
                "4.3m", "The limit, executed by NFTSM_1 only, is why its error changes so much", s.limit_is_the_reason
            ),
            FlownClaim("4.3n", "From 350 s to 400 s SMC is about 10.3 s late", s.delayed),
        ),
        "5 Conclusions": (
            FlownClaim("5a", "The body's constraints can be satisfied", s.constraints_satisfied),
            FlownClaim("5b", "The law suits high manoeuvring targets", s.high_manoeuvring),
            FlownClaim("5c", "α2 and β2 can reduce the convergence time but bring the shock", s.alpha2_and_beta2),
        ),
    }
)
