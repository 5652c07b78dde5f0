% SPART's matrices of the preset `chaser` at the pose of golden fact C17. Run: SPART=<its folder> octave --no-gui spart.m > spart-chaser.csv
% Rows: name, rows, columns, values row by row. Twists are angular part first, inertial axes; the base's is its rate and velocity.
src = getenv('SPART');
addpath([src '/src/attitude_transformations'], [src '/src/kinematics_dynamics'], [src '/src/robot_model'], [src '/src/utils']);
z = [0; 0; 1]; y = [0; 1; 0]; x = [1; 0; 0];
mass = [8, 18, 14.7, 7, 6, 5];
center = [0 0 0.1; 0.95 -0.01 0; 0.8 0.01 0; 0.1 -0.01 0; 0.075 0.01 0; 0.075 -0.01 0]';
inertia = [0.033866666666667 0.033866666666667 0.0144; 0.0324 5.4312 5.4312; 0.02646 3.14923 3.14923; ...
  0.0126 0.029633333333333 0.029633333333333; 0.0108 0.01665 0.01665; 0.009 0.013875 0.013875];
place = [0.9 0 0.6; 0 0 0.2; 1.9 0 0; 1.6 0 0; 0.2 0 0; 0.15 0 0]';
axes = {z, y, y, x, y, x};
at = @(p) [eye(3), p; 0 0 0 1];
robot.n_links_joints = 6; robot.n_q = 6;
robot.base_link.mass = 1500;
robot.base_link.inertia = [650 -12 8; -12 700 5; 8 5 762];
for i = 1:6
  % Frames of SPART's links lie in their centres of mass.
  before = [0; 0; 0];
  if i > 1, before = center(:, i - 1); end
  robot.joints(i) = struct('id', i, 'type', 1, 'q_id', i, 'parent_link', i - 1, 'child_link', i, 'axis', axes{i}, 'T', at(place(:, i) - before));
  robot.links(i) = struct('id', i, 'parent_joint', i, 'T', at(center(:, i)), 'mass', mass(i), 'inertia', diag(inertia(i, :)));
end
[robot.con.branch, robot.con.child, robot.con.child_base] = ConnectivityMap(robot);
q = [0.3; -0.9; 1.4; 0.2; -0.6; 0.5];
Q = [0.9 0.1 -0.3 0.3] / norm([0.9 0.1 -0.3 0.3]);
% SPART has the scalar last, and its matrix leads from inertial axes to body axes.
R0 = quat_DCM([Q(2:4) Q(1)]')';
r0 = [0.4; -0.3; 0.2];
[RJ, RL, rJ, rL, e, g] = Kinematics(R0, r0, q, robot);
[I0, Im] = I_I(R0, RL, robot);
[Bij, Bi0, P0, pm] = DiffKinematics(R0, r0, rL, e, g, robot);
P0 = eye(6); % the base's rate in inertial axes
[M0, Mm] = MCB(I0, Im, Bij, Bi0, robot);
[H0, H0m, Hm] = GIM(M0, Mm, Bij, Bi0, P0, pm, robot);
tip = rL(:, 6) + RL(:, :, 6) * ([0.15; 0; 0] - center(:, 6));
[J0, Jm] = Jacob(tip, r0, rL, P0, pm, 6, robot);
Jg = Jm - J0 * (H0 \ H0m);
function put(name, m)
  printf('%s,%d,%d', name, rows(m), columns(m)); printf(',%.17g', m'); printf('\n');
end
put('H0', H0); put('H0m', H0m); put('Hm', Hm); put('J0', J0); put('Jm', Jm); put('Jg', Jg);
