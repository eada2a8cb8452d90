#include <algorithm>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "tools/learn_file.hpp"
#include "tools/learn_looks.hpp"
#include "tools/learn_trial.hpp"

namespace {

namespace learn = cyclops::tools::learn;

int fail(const cyclops::Error& error) {
  std::fprintf(stderr, "cyclops-learn: %s\n", error.message().c_str());
  return 1;
}

struct Options {
  std::vector<std::string> flights, tests;
  std::string config, out, strength, tanker, figures, looks, survey_looks;
  bool add{false}, quiet{false};
  learn::LearnConfig learning{};
};

void declare(CLI::App& app, Options& o) {
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.add_option("flights", o.flights, "flights to learn from, all of one tanker; FOLDER@FROM-TO takes a part, in seconds");
  app.add_option("--out", o.out, "model file to write");
  app.add_flag("--add", o.add, "the surveyed features stay switched on; learnt ones too near to one are left out");
  app.add_option("--strength", o.strength, "strength by flight and range of each learnt point, JSON");
  app.add_option("--looks", o.looks, "looks of the features that are switched on in the model: written with --out, tried with --tanker");
  app.add_option("--survey-looks", o.survey_looks, "looks of the surveyed features, to go with their own model: the same");
  app.add_option("--config", o.config, "profile; the built-in default when left out");
  app.add_option("--test", o.tests, "flights with truth to try the model on, beside the surveyed features; FOLDER@FROM-TO as above");
  app.add_option("--tanker", o.tanker, "with --test alone: the model to try");
  app.add_option("--figures", o.figures, "what --test found, JSON");
  app.add_option("--views", o.learning.views.most_views, "views of a flight")->check(CLI::Range(10, 2000))->capture_default_str();
  app.add_option("--points", o.learning.choose.most_points, "points to keep")->check(CLI::Range(4, 1000))->capture_default_str();
  app.add_flag("-q,--quiet", o.quiet, "no progress");
}

cyclops::Result<std::vector<learn::Stretch>> stretches(const std::vector<std::string>& texts) {
  std::vector<learn::Stretch> out;
  for (const std::string& t : texts) {
    auto s = learn::Stretch::parse(t);
    if (!s.ok()) return s.error();
    out.push_back(std::move(s).value());
  }
  return out;
}

/// `model`: as written, or empty for the surveyed one.
cyclops::Result<> write_looks(const Options& o, const cyclops::Profile& profile, const learn::Learnt& learnt, const std::string& path, const std::string& model, const learn::Said& said) {
  const learn::Views& views = learnt.views;
  cyclops::TankerModel tanker = views.tanker;
  if (!model.empty()) {
    auto read = cyclops::TankerModel::parse(model, o.out, views.metres_per_unit, views.tanker.ins().xyz / views.metres_per_unit);
    if (!read.ok()) return read.error();
    tanker = std::move(read).value();
  }
  const cyclops::Looks looks = learn::learn_looks(profile.patch, {}, views, tanker);
  said(path + ": " + std::to_string(looks.items.size()) + " looks");
  return learn::write_text(path, looks.text());
}

cyclops::Result<> learn_it(const Options& o, const cyclops::Profile& profile) {
  auto flights = stretches(o.flights);
  if (!flights.ok()) return flights.error();
  const auto said = [&](const std::string& text) {
    if (!o.quiet) std::fprintf(stderr, "cyclops-learn: %s\n", text.c_str());
  };
  learn::LearnConfig config = o.learning;
  config.views.pictures = !o.looks.empty() || !o.survey_looks.empty();
  auto learnt = learn::learn(*flights, profile, config, said);
  if (!learnt.ok()) return learnt.error();
  const std::string model = learn::model_csv(*learnt, o.add ? learn::Mix::kAdd : learn::Mix::kReplace, o.learning.choose.apart_px);
  CYCLOPS_TRY(learn::write_text(o.out, model));
  if (!o.looks.empty()) CYCLOPS_TRY(write_looks(o, profile, *learnt, o.looks, model, said));
  if (!o.survey_looks.empty()) CYCLOPS_TRY(write_looks(o, profile, *learnt, o.survey_looks, {}, said));
  if (!o.strength.empty()) CYCLOPS_TRY(learn::write_text(o.strength, learn::strength_json(*learnt)));
  std::printf("%s: %zu points from %zu views, %zu of them where a surveyed feature is\n", o.out.c_str(), learnt->points.size(), learnt->views.views.size(),
              static_cast<std::size_t>(std::count_if(learnt->points.begin(), learnt->points.end(), [](const auto& c) { return c.point.survey >= 0; })));
  return cyclops::Ok{};
}

cyclops::Result<> test_it(const Options& o, const cyclops::Profile& profile, const std::string& tanker) {
  auto flights = stretches(o.tests);
  if (!flights.ok()) return flights.error();
  nlohmann::json all = nlohmann::json::array();
  std::vector<std::pair<std::string, std::string>> trials{{{}, {}}, {tanker, {}}};  // model, looks
  if (!o.survey_looks.empty()) trials.emplace_back("", o.survey_looks);
  if (!o.looks.empty()) trials.emplace_back(tanker, o.looks);
  for (const learn::Stretch& s : *flights)
    for (const auto& [model, looks] : trials) {
      auto figures = learn::try_model(s, model, looks, profile);
      if (!figures.ok()) return figures.error();
      std::printf("%s\n", learn::trial_line(*figures).c_str());
      std::fflush(stdout);
      all.push_back(*figures);
    }
  if (o.figures.empty()) return cyclops::Ok{};
  return learn::write_text(o.figures, all.dump(1) + "\n");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Learns points of the tanker from recorded flights, and tries a model on flights with truth. docs/learning.md"};
  Options o;
  declare(app, o);
  app.final_callback([&o] {
    if (o.flights.empty() && (o.tests.empty() || o.tanker.empty())) throw CLI::ValidationError("nothing to do, expected flights with --out, or --test with --tanker");
    if (o.flights.empty() != o.out.empty()) throw CLI::ValidationError("--out", "goes with flights to learn from, expected both or neither");
    if (!o.flights.empty() && !o.tanker.empty()) throw CLI::ValidationError("--tanker", "stands beside flights to learn from, expected one of the two");
  });
  CLI11_PARSE(app, argc, argv);
  cyclops::Profile profile;
  if (!o.config.empty()) {
    auto loaded = cyclops::Profile::load(o.config);
    if (!loaded.ok()) return fail(loaded.error());
    profile = *loaded;
  }
  if (!o.flights.empty())
    if (auto done = learn_it(o, profile); !done.ok()) return fail(done.error());
  if (!o.tests.empty())
    if (auto done = test_it(o, profile, o.tanker.empty() ? o.out : o.tanker); !done.ok()) return fail(done.error());
  return 0;
}
