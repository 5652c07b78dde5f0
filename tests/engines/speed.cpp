// Forward dynamics of a free-floating robot in Pinocchio (`aba`) or MuJoCo (`mj_forward`), ns per call: the fastest of 40
// batches. Reads the robot that `space_speed robot CASE` prints; for MuJoCo the path of its XML. compare.py builds and calls it.
#ifdef MUJOCO
#include <mujoco/mujoco.h>
#else
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/multibody.hpp>
#endif
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

template <class Call> double fastest(Call call) {
  double best = 1e300;
  for (int batch = 0; batch < 40; ++batch) {
    const int count = 5000;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < count; ++i) call();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    best = std::min(best, took.count() / count * 1e9);
  }
  return best;
}

int main(int argc, char **argv) {
#ifdef MUJOCO
  char error[500];
  mjModel *model = mj_loadXML(argv[argc - 1], nullptr, error, sizeof error);
  if (!model) return std::fprintf(stderr, "%s\n", error), 1;
  mjData *data = mj_makeData(model);
  for (int i = 0; i < model->nv; ++i) data->qvel[i] = 0.3 * std::sin(i), data->qfrc_applied[i] = std::cos(i);
  for (int i = 7; i < model->nq; ++i) data->qpos[i] = 0.3 * std::sin(i);
  std::printf("%.1f\n", fastest([&] { data->qpos[7] += 1e-9, mj_forward(model, data); }));
#else
  (void)argc, (void)argv;
  using namespace pinocchio;
  const auto numbers = [](const std::string &line) {
    std::istringstream in(line);
    std::vector<double> v;
    for (double x; in >> x;) v.push_back(x);
    return v;
  };
  const auto matrix = [](const double *v) {
    Eigen::Matrix3d m;
    for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = v[i];
    return m;
  };
  Model model;
  std::string line;
  std::getline(std::cin, line);
  std::vector<double> base = numbers(line);
  std::vector<JointIndex> ids = {model.addJoint(0, JointModelFreeFlyer(), SE3::Identity(), "base")};
  model.appendBodyToJoint(ids[0], Inertia(base[0], Eigen::Vector3d::Zero(), matrix(&base[1])), SE3::Identity());
  while (std::getline(std::cin, line)) {
    const std::vector<double> v = numbers(line);
    const auto three = [&](int at) { return Eigen::Vector3d(v[at], v[at + 1], v[at + 2]); };
    const SE3 place(Eigen::Matrix3d::Identity(), three(14));
    ids.push_back(model.addJoint(ids[int(v[0])], JointModelRevoluteUnaligned(three(17)), place, "j" + std::to_string(ids.size())));
    model.appendBodyToJoint(ids.back(), Inertia(v[1], three(2), matrix(&v[5])), SE3::Identity());
  }
  model.gravity.setZero();
  Data data(model);
  Eigen::VectorXd q = neutral(model), v(model.nv), tau(model.nv);
  for (int i = 0; i < model.nv; ++i) v[i] = 0.3 * std::sin(i), tau[i] = std::cos(i);
  for (int i = 7; i < model.nq; ++i) q[i] = 0.3 * std::sin(i);
  double sum = 0;
  std::printf("%.1f\n", fastest([&] { q[7] += 1e-9, aba(model, data, q, v, tau), sum += data.ddq[0]; }));
  if (sum == 0.123) std::puts("");
#endif
}
