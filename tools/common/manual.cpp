// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/manual.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "mono3d/core/version.h"

namespace mono3d::tools {
namespace {

std::vector<const CLI::App*> Subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

// As troff takes it: no dash is a hyphen, and no line begins with a command.
std::string Troff(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    const bool begins_line = escaped.empty() || escaped.back() == '\n';
    if (begins_line && (c == '.' || c == '\'')) escaped += "\\&";
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string NamesOf(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : option.get_snames()) names += "-" + name + ", ";
  for (const std::string& name : option.get_lnames()) names += "--" + name + ", ";
  if (!names.empty()) names.resize(names.size() - 2);
  return names.empty() ? option.get_name() : names;
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

void WriteOptions(const CLI::App& app, std::ostringstream& page) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string type = TakesValue(*option) ? option->get_type_name() : "";
    const bool has_value = !type.empty() && !option->get_lnames().empty();
    page << ".TP\n.BI \"" << Troff(NamesOf(*option)) << '"';
    if (has_value) page << " \" " << Troff(type) << '"';
    page << '\n';
    page << Troff(option->get_description());
    const std::string value = option->get_default_str();
    if (!value.empty() && TakesValue(*option)) page << " (default: " << Troff(value) << ')';
    page << '\n';
  }
}

// One word after the other, for compgen.
std::string LongNames(const CLI::App& app) {
  std::string names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names += "--" + name + " ";
  }
  return names;
}

// Letters that are wrong, missing, too many, or two neighbours that have changed places (Damerau
// and Levenshtein, each part edited once). O(a * b).
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> at(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) at[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) at[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = at[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      at[i][j] = std::min({replaced, at[i - 1][j] + 1, at[i][j - 1] + 1});
      const bool is_swap = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (is_swap) at[i][j] = std::min(at[i][j], at[i - 2][j - 2] + 1);
    }
  }
  return at[a.size()][b.size()];
}

}  // namespace

std::string ManPage(const CLI::App& app, const std::string& examples) {
  std::ostringstream page;
  std::string title = app.get_name();
  for (char& c : title) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  const std::string& description = app.get_description();
  page << ".TH " << Troff(title) << " 1 \"\" \"mono3d " << Version() << "\"\n.SH NAME\n"
       << Troff(app.get_name()) << " \\- " << Troff(description.substr(0, description.find('\n')))
       << "\n.SH SYNOPSIS\n.B " << Troff(app.get_name()) << "\n[\\fIoptions\\fR]";
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional()) page << " " << Troff(option->get_name());
  }
  page << "\n.SH OPTIONS\n";
  WriteOptions(app, page);
  for (const CLI::App* subcommand : Subcommands(app)) {
    page << ".SH \"" << Troff(app.get_name() + " " + subcommand->get_name()) << "\"\n"
         << Troff(subcommand->get_description()) << '\n';
    WriteOptions(*subcommand, page);
  }
  if (!examples.empty()) page << ".SH EXAMPLES\n.nf\n" << Troff(examples) << "\n.fi\n";
  page << ".SH \"EXIT STATUS\"\n0, 2 for wrong usage, 1 for any other failure.\n";
  return page.str();
}

std::string BashCompletion(const CLI::App& app) {
  std::string function = "_" + app.get_name();
  std::ranges::replace(function, '-', '_');
  std::ostringstream script;
  script << "# bash completion of " << app.get_name() << "\n"
         << function << "() {\n"
         << "  local word=\"${COMP_WORDS[COMP_CWORD]}\" options=\"" << LongNames(app) << "\"\n";
  const std::vector<const CLI::App*> subcommands = Subcommands(app);
  if (!subcommands.empty()) {
    std::string names;
    for (const CLI::App* subcommand : subcommands) names += subcommand->get_name() + " ";
    script << "  if [ \"$COMP_CWORD\" -eq 1 ] && [[ \"$word\" != -* ]]; then\n"
           << "    mapfile -t COMPREPLY < <(compgen -W \"" << names << "\" -- \"$word\")\n"
           << "    return\n  fi\n  case \"${COMP_WORDS[1]}\" in\n";
    for (const CLI::App* subcommand : subcommands) {
      script << "    " << subcommand->get_name() << ") options=\"" << LongNames(*subcommand)
             << "\";;\n";
    }
    script << "  esac\n";
  }
  script << "  if [[ \"$word\" == -* ]]; then\n"
         << "    mapfile -t COMPREPLY < <(compgen -W \"$options\" -- \"$word\")\n"
         << "  else\n"
         << "    mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n"
         << "  fi\n}\n"
         << "complete -o filenames -F " << function << " " << app.get_name() << "\n";
  return script.str();
}

std::string NearestOption(const CLI::App& app, std::string_view word) {
  std::string nearest;
  // A third of the letters may be wrong; in a short word, two.
  std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
  const auto look_at = [&](const CLI::App& one) {
    for (const CLI::Option* option : one.get_options()) {
      for (const std::string& name : option->get_lnames()) {
        const std::size_t distance = EditDistance(word, name);
        if (distance >= least) continue;
        least = distance;
        nearest = name;
      }
    }
  };
  look_at(app);
  for (const CLI::App* subcommand : Subcommands(app)) look_at(*subcommand);
  return nearest;
}

}  // namespace mono3d::tools
