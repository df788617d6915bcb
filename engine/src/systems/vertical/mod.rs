//! Paper 2: how well a foot knows its height when an altimeter aids it.
//!
//! # The model
//!
//! Upwards a foot has two errors, of the height h and of the velocity v:
//!
//! ḣ = v, v̇ = white noise of density q = VRW²,
//!
//! and two aids. The altimeter reads h with sigma σ_a at the rate f_a, at any time. In stance, a share s
//! of the gait cycle T, zero velocity measures v with sigma σ_z at the rate f of the IMU. In units of
//! knowledge a second these are r_h = f_a/σ_a² and, in stance, r_s = f/σ_z². Like the paper, it leaves
//! out what tilt and the accelerometer's bias add: see below.
//!
//! The quantity that is meant everywhere here is the **sigma of the filter over a gait cycle**: the root of
//! the mean, over the cycle, of the height's variance at every IMU sample, what was measured then included.
//!
//! # Zero velocity alone: the height's drift
//!
//! Without the altimeter the height's variance grows by D a second. The sum of all that zero velocity
//! tells of v(t) is the operator K = −(1/q) d²/dt² + r(t), with r = r_s in stance and 0 in swing, and the
//! variance of ∫v dt over many cycles is the mean of K⁻¹ 1. So D is the mean of u(t) for the periodic u of
//!
//! u″ = q (r(t) u − 1).
//!
//! In stance, t from its middle, u = 1/r_s + A cosh κt with κ = √(q r_s). In swing, t from its middle,
//! u = B − q t²/2. Value and slope agree where the foot lifts; with T_s = s T in stance and T_w = T − T_s
//! in swing that gives
//!
//! D = (1/T) \[ (T_s + 2 T_w)/r_s + (q T_w²/(2κ)) coth(κ T_s/2) + q T_w³/12 \].  **(1)**
//!
//! The last term is what a velocity that is known at both ends of a swing leaves open in between (a
//! Brownian bridge). For a small κT, D is 1/(s r_s): each zero velocity counts by itself.
//!
//! # With the altimeter
//!
//! Where zero velocity measures all the time with knowledge r_v, the algebraic Riccati equation
//!
//! 0 = 2 P_hv − r_h P_hh² − r_v P_hv²,
//! 0 = P_vv − r_h P_hh P_hv − r_v P_hv P_vv,
//! 0 = q − r_h P_hv² − r_v P_vv²
//!
//! has a closed solution. The closed loop of a filter for (h, v) has the characteristic polynomial
//! λ² + a λ + b with b = √(q r_h) and a² = q r_v + 2b (the stable half of λ⁴ − q r_v λ² + q r_h). Its
//! trace is a = r_h P_hh + r_v P_vv, so the second equation says P_vv = a P_hv; put into the third,
//!
//! P_hv = √q/(√r_h + r_v √q),  P_vv = a P_hv,  P_hh = a/(√r_h (√r_h + r_v √q)).  **(2)**
//!
//! A gait zeroes the velocity now and then. What the altimeter sees of that, being slower than a stride, is
//! the drift D of (1); so r_v is taken as 1/D. With ε = D √(r_h/q)
//!
//! σ² = √(D/r_h) · √(1 + 2ε)/(1 + ε).  **(3)**
//!
//! * ε ≪ 1, a dull altimeter: σ² = √(D/r_h), and for a small VRW the altimeter's sigma times that of zero
//!   velocity over √(f s f_a), in which VRW is no longer found.
//! * ε ≫ 1, a sharp altimeter: σ² = √2 q^¼ r_h^(−¾). Zero velocity has no part in it.
//!
//! It does not see that the sigma rises and falls with the gait, or between two readings of the altimeter.
//! Where the altimeter is sharp enough to follow a single swing ((q r_h)^¼ T_w of some units) and VRW large
//! enough to dominate in one, it is off by up to about 15 %: the tests say where.
//!
//! # How it settles
//!
//! From a start covariance P₀ = P∞ + E the Riccati equation has the solution
//!
//! P(t) = P∞ + Ψ E (1 + W E)⁻¹ Ψ',  Ψ = e^{Ft},  W = N − Ψ' N Ψ,  F'N + N F = −diag(r_h, r_v),  **(4)**
//!
//! where F = \[−r_h P_hh, 1 − r_v P_hv; −r_h P_hv, −r_v P_vv\] is the closed loop of (2). All of it is 2×2.
//! For a dull altimeter it is (σ² − σ∞²)/(σ² + σ∞²) ∝ e^(−2 √(D r_h) t). The velocity starts as sure as
//! standing still makes it, P_vv = √(q/r_s).
//!
//! # What the paper prints
//!
//! [`printed_form`] is the paper's own last equation as it stands: P₃₃, so a variance, although the paper
//! plots it as a sigma. It lets P_hv grow from 0 since the start of each gait cycle, where the Riccati
//! equation holds it near D, and its units do not balance: times told in milliseconds give another sigma.
//! Its root has the right slope for a dull altimeter, about twice the filter's sigma with the figures of the
//! paper, and another one for a sharp one; it grows with √VRW, of which the filter's sigma is free there.
//!
//! # What is left out
//!
//! Tilt turns the swing's horizontal acceleration upwards, and an accelerometer bias that is no longer told
//! from tilt makes a slope. A filter whose biases are known and whose gyro is as quiet as the paper's agrees
//! with (3): `tests/tests/engine/height.rs` holds the engine's own error filter, with all 15 states, on a
//! walking foot against it.
//!
//! # Contents
//!
//! [`setup`] the figures that go in; [`closed_form`] equations (1) to (4); [`printed_form`] the paper's;
//! [`riccati`] the filter's covariance sample by sample, the reference; [`trial`] the filter at work on
//! drawn noise.

pub mod closed_form;
pub mod printed_form;
pub mod riccati;
pub mod setup;
pub mod trial;

pub use setup::Setup;
