% Computing time of the algorithm of the thesis in plain Octave, with its two errors corrected.
%
% The steel guide, held at -18 mm and released, hits a wall at 0 with the restitution 0.6.  The
% guide is a chain of links in absolute angles, closed by Lagrange multipliers.  It is integrated by
% the Runge-Kutta method of order 4 at the step 2^-15 s; positions are projected after every step,
% and an impact is applied at the first step behind the wall.
% The script prints for the 1R and the 2R model the seconds of wall time per simulated second:
%
%     octave-cli --no-gui --quiet benchmarks/thesis_algorithm.m [SPAN]
%
% SPAN is the time to simulate, 0.05 s by default; the first impact is at 0.04 s.
% Method: S. Boersma, MSc thesis, TU Delft 2015, appendix A; in NumPy: fmu_src/prbm/references/source_model.py.

1;  % Makes this a script file instead of a function file.


function m = guide_1R()
  % One pivot per half flexure; the masses of the flexures are lumped at the moving pivots.
  p = steel();
  gamma = 0.8517;
  r = gamma * p.L;
  lumped = p.m / 4 + p.m * p.L^2 / 12 / r^2;
  m.length = [r; p.W; r];
  m.mass = [lumped; p.shuttle_mass; lumped];
  m.along = [r; p.W / 2; 0];
  m.across = [0; p.com_height + (p.L - r) / 2; 0];
  m.inertia = [0; p.shuttle_mass * p.W^2 / 12; 0];
  m.straight = [pi/2; 0; -pi/2];
  m.rate = 2 * gamma * 2.65 * p.EI / p.L * ones(4, 1);
  m.shuttle = 2;
  m.distance = p.W;
  m.gravity = p.gravity;
end


function m = guide_2R()
  % Two pivots per half flexure; links are slender rods.  The spring rates have no factor gamma.
  p = steel();
  h = p.L / 2;
  rods = h * [0.44; 2 * 0.46; 0.44];
  masses = p.m * rods / p.L;
  m.length = [rods; p.W; rods];
  m.mass = [masses; p.shuttle_mass; masses];
  m.along = m.length / 2;
  m.across = [0; 0; 0; p.com_height + 0.1 * h; 0; 0; 0];
  m.inertia = [masses .* rods.^2 / 12; p.shuttle_mass * p.W^2 / 12; masses .* rods.^2 / 12];
  m.straight = [pi/2; pi/2; pi/2; 0; -pi/2; -pi/2; -pi/2];
  m.rate = p.EI / h * [3.4710; 2.0682; 2.0682; 3.4710; 3.4710; 2.0682; 2.0682; 3.4710];
  m.shuttle = 4;
  m.distance = p.W;
  m.gravity = p.gravity;
end


function p = steel()
  % Data of the steel guide in SI units.
  p.L = 40e-3;
  p.W = 80e-3;
  p.EI = 181.5e9 * 8e-3 * (0.1e-3)^3 / 12;
  p.m = 7800 * p.L * 0.1e-3 * 8e-3;
  p.shuttle_mass = 53.187e-3;
  p.com_height = 17.77e-3;
  p.gravity = 9.81;
end


function [Tx, Ty, Gx, Gy] = centres(m, q)
  % Jacobians T and G of the centres of mass: velocities T qd, accelerations T qdd + G qd.^2.
  n = length(q);
  along = tril(ones(n), -1) .* m.length' + diag(m.along);
  across = diag(m.across);
  c = cos(q)';
  s = sin(q)';
  Tx = -along .* s - across .* c;
  Ty = along .* c - across .* s;
  Gx = -Ty;
  Gy = Tx;
end


function M = mass_matrix(m, Tx, Ty)
  M = Tx' * (m.mass .* Tx) + Ty' * (m.mass .* Ty) + diag(m.inertia);
end


function Q = force(m, q, Tx)
  % Forces of the springs, between the links and at both clamps, and gravity along +x.
  bend = diff([0; q - m.straight; 0]);
  torque = m.rate .* bend;
  Q = diff(torque) + m.gravity * Tx' * m.mass;
end


function [Phi, Phi_q, closing] = loop(m, q, qd)
  % Gap between the chain's end and the right clamp, its Jacobian, and -(d/dt Phi_q) qd.
  c = m.length .* cos(q);
  s = m.length .* sin(q);
  Phi = [sum(c) - m.distance; sum(s)];
  Phi_q = [-s'; c'];
  closing = [c' * qd.^2; s' * qd.^2];
end


function yd = dynamics(m, y)
  n = length(y) / 2;
  q = y(1:n);
  qd = y(n+1:end);
  [Tx, Ty, Gx, Gy] = centres(m, q);
  M = mass_matrix(m, Tx, Ty);
  f = force(m, q, Tx) - Tx' * (m.mass .* (Gx * qd.^2)) - Ty' * (m.mass .* (Gy * qd.^2));
  [~, Phi_q, closing] = loop(m, q, qd);
  solution = [M, Phi_q'; Phi_q, zeros(2)] \ [f; closing];
  yd = [qd; solution(1:n)];
end


function y = rk4(m, y, h)
  k1 = dynamics(m, y);
  k2 = dynamics(m, y + h/2 * k1);
  k3 = dynamics(m, y + h/2 * k2);
  k4 = dynamics(m, y + h * k3);
  y = y + h/6 * (k1 + 2*k2 + 2*k3 + k4);
end


function y = project(m, y)
  % Close the loop by Gauss-Newton steps; rates are not changed.
  n = length(y) / 2;
  for iteration = 1:10
    [Phi, Phi_q] = loop(m, y(1:n), y(n+1:end));
    if max(abs(Phi)) <= 1e-13
      break
    end
    y(1:n) = y(1:n) - Phi_q' * ((Phi_q * Phi_q') \ Phi);
  end
end


function [gap, G] = contact(m, q)
  % Distance of the hit point, on the far side of the shuttle, from the wall, and its gradient.
  k = m.shuttle;
  x = m.length(1:k)' * cos(q(1:k)) - m.across(k) * sin(q(k));
  gap = m.distance - x;
  G = zeros(1, length(q));
  G(1:k) = (m.length(1:k) .* sin(q(1:k)))';
  G(k) = G(k) + m.across(k) * cos(q(k));
end


function y = impact(m, y, restitution)
  n = length(y) / 2;
  q = y(1:n);
  qd = y(n+1:end);
  [Tx, Ty] = centres(m, q);
  M = mass_matrix(m, Tx, Ty);
  [~, Phi_q] = loop(m, q, qd);
  [~, G] = contact(m, q);
  rows = [Phi_q; G];
  solution = [M, rows'; rows, zeros(3)] \ [M * qd; 0; 0; -restitution * (G * qd)];
  y(n+1:end) = solution(1:n);
end


function q = held_shape(m, displacement)
  % Equilibrium with the shuttle held at the displacement, by Newton's method in ten stages with a
  % tangent by finite differences.
  n = length(m.straight);
  z = [m.straight; zeros(3, 1)];
  for stage = 1:10
    for iteration = 1:10
      R = imbalance(m, z, displacement * stage / 10);
      tangent = zeros(n + 3);
      for j = 1:n+3
        dz = zeros(n + 3, 1);
        dz(j) = 1e-7;
        tangent(:, j) = (imbalance(m, z + dz, displacement * stage / 10) - R) / 1e-7;
      end
      z = z - tangent \ R;
    end
  end
  q = z(1:n);
end


function R = imbalance(m, z, displacement)
  n = length(m.straight);
  q = z(1:n);
  Tx = centres(m, q);
  [Phi, Phi_q] = loop(m, q, zeros(n, 1));
  k = m.shuttle;
  x = m.length(1:k-1)' * cos(q(1:k-1)) + m.along(k) * cos(q(k)) - m.across(k) * sin(q(k));
  R = [force(m, q, Tx) - Phi_q' * z(n+1:n+2) - Tx(k, :)' * z(n+3); Phi; ...
       x - m.along(k) - displacement];
end


function [t, y, impact_times] = simulate(m, y, span, h, restitution)
  % While the body is behind the wall after an impact, no further impact is applied.
  n = length(m.straight);
  steps = round(span / h);
  t = h * (0:steps)';
  states = zeros(steps + 1, 2 * n);
  states(1, :) = y';
  impact_times = [];
  behind = false;
  for step = 1:steps
    touching = contact(m, y(1:n)) < 0;
    if touching && !behind
      y = impact(m, y, restitution);
      impact_times(end+1) = t(step);
    end
    behind = touching;
    y = project(m, rk4(m, y, h));
    states(step + 1, :) = y';
  end
  y = states;
end


span = 0.05;
given = argv();
if !isempty(given) && !isnan(str2double(given{end}))
  span = str2double(given{end});
end
names = {"1R", "2R"};
guides = {guide_1R(), guide_2R()};
for i = 1:2
  m = guides{i};
  q = held_shape(m, -18e-3);
  watch = tic();
  [t, y, impact_times] = simulate(m, [q; zeros(size(q))], span, 2^-15, 0.6);
  elapsed = toc(watch);
  if !all(isfinite(y(:)))
    error("%s: the simulation did not stay finite", names{i});
  end
  printf("%s %.1f\n", names{i}, elapsed / span);
end
