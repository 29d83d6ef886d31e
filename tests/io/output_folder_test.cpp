#include "curvesup/io/output_folder.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "curvesup/io/sha256.h"
#include "curvesup/io/text_file.h"
#include "helpers/temp_folder.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

namespace fs = std::filesystem;

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

void make_output(const fs::path& path, const std::string& report) {
  OutputFolder out(path);
  out.write("manifest.json", "{}");
  out.write("report.json", report);
  out.commit();
}

TEST(OutputFolder, AppearsWholeAtCommit) {
  const TempFolder folder;
  const fs::path out_path = folder.path() / "made" / "on_the_way" / "out";
  OutputFolder out(out_path);
  out.write("report.json", "abc");
  out.write("robot/part_0001.script", "def program():\n");
  EXPECT_FALSE(fs::exists(out_path));
  out.commit();
  EXPECT_EQ(read_file(out_path / "robot" / "part_0001.script"), "def program():\n");
  EXPECT_EQ(entries(out_path), 2u);
  EXPECT_EQ(entries(out_path.parent_path()), 1u) << "nothing but the output";
  ASSERT_EQ(out.files().size(), 2u);
  EXPECT_EQ(out.files()[0].sha256, sha256_hex("abc"));
  EXPECT_EQ(out.files()[1].path, "robot/part_0001.script");
  EXPECT_EQ(out.files()[1].bytes, 15u);
}

TEST(OutputFolder, FilesInPiecesAreTheSameOnAnyNumberOfThreads) {
  for (const int threads : {1, 3}) {
    const TempFolder folder;
    OutputFolder out(folder.path() / "out");
    std::vector<OutputFolder::Task> tasks;
    for (int i = 0; i < 20; ++i) {
      tasks.push_back({"t/" + std::to_string(i), [i](const ByteSink& sink) {
                         for (int k = 0; k < 20 - i; ++k) sink("piece " + std::to_string(i) + "\n");
                       }});
    }
    RunContext run;
    run.threads = threads;
    out.write_all(tasks, run);
    ASSERT_EQ(out.files().size(), 20u);
    for (int i = 0; i < 20; ++i) {
      const std::string bytes = read_file(out.working_path() / "t" / std::to_string(i));
      EXPECT_EQ(out.files()[i].path, "t/" + std::to_string(i));
      EXPECT_EQ(out.files()[i].bytes, bytes.size());
      EXPECT_EQ(bytes.size(), (20u - i) * (i < 10 ? 8u : 9u));
      EXPECT_EQ(out.files()[i].sha256, sha256_hex(bytes));
    }
  }
}

TEST(OutputFolder, AFileThatFailsHalfwayIsNotThere) {
  const TempFolder folder;
  OutputFolder out(folder.path() / "out");
  const auto produce = [](const ByteSink& sink) {
    sink("begun");
    throw Error(ErrorKind::internal, "producer", "broke");
  };
  expect_error(ErrorKind::internal, {"producer"}, [&] { out.write("x", produce); });
  EXPECT_EQ(entries(out.working_path()), 0u);
  EXPECT_TRUE(out.files().empty());
}

TEST(OutputFolder, WithoutCommitNothingIsLeft) {
  const TempFolder folder;
  {
    OutputFolder out(folder.path() / "a" / "b" / "out");
    out.write("x/y/z.txt", "z");
  }
  EXPECT_EQ(entries(folder.path()), 0u);
}

TEST(OutputFolder, OlderOutputStaysUntilCommitThenGoesWhole) {
  const TempFolder folder;
  const fs::path path = folder.path() / "out";
  make_output(path, "first");
  fs::create_directory(path / "robot");
  {
    OutputFolder out(path);
    out.write("report.json", "second");
  }
  EXPECT_EQ(read_file(path / "report.json"), "first");
  make_output(path.string() + "/", "third");
  EXPECT_EQ(read_file(path / "report.json"), "third");
  EXPECT_FALSE(fs::exists(path / "robot"));
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(OutputFolder, ForeignFoldersAndFilesAreRefused) {
  const TempFolder folder;
  fs::create_directory(folder.path() / "photos");
  write_file(folder.path() / "photos" / "manifest.json", "{}");
  expect_error(ErrorKind::output, {"photos", "report.json"}, [&] { OutputFolder out(folder.path() / "photos"); });
  write_file(folder.path() / "file", "");
  expect_error(ErrorKind::output, {"file", "not a folder"}, [&] { OutputFolder out(folder.path() / "file"); });
  expect_error(ErrorKind::output, {"file"}, [&] { OutputFolder out(folder.path() / "file" / "out"); });
  expect_error(ErrorKind::output, {}, [&] { OutputFolder out(""); });
  expect_error(ErrorKind::output, {}, [&] { OutputFolder out("/"); });
  EXPECT_EQ(entries(folder.path()), 2u);

  fs::create_directory(folder.path() / "empty");
  make_output(folder.path() / "empty", "x");
  EXPECT_EQ(read_file(folder.path() / "empty" / "report.json"), "x");
}

TEST(OutputFolder, AFolderThatBecameForeignMeanwhileIsKept) {
  const TempFolder folder;
  const fs::path path = folder.path() / "out";
  OutputFolder out(path);
  fs::create_directory(path);
  write_file(path / "precious.txt", "x");
  expect_error(ErrorKind::output, {"out"}, [&] { out.commit(); });
  EXPECT_EQ(read_file(path / "precious.txt"), "x");
}

TEST(OutputFolder, UnwritablePlaceIsAnOutputError) {
  expect_error(ErrorKind::output, {"/proc"}, [] { OutputFolder out("/proc/curvesup_out"); });
  expect_error(ErrorKind::output, {"/proc"}, [] { OutputFolder out("/proc/no/such/out"); });
}

TEST(OutputFolder, FilesStayInside) {
  const TempFolder folder;
  OutputFolder out(folder.path() / "out");
  for (const char* bad : {"../x", "/tmp/x", "", "a/../../x", "a/"}) {
    expect_error(ErrorKind::internal, {"output folder"}, [&] { out.write(bad, "x"); });
  }
}

TEST(OutputFolder, LinksAreFollowed) {
  const TempFolder folder;
  make_output(folder.path() / "real", "first");
  fs::create_directory_symlink(folder.path() / "real", folder.path() / "link");
  make_output(folder.path() / "link", "second");
  EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
  EXPECT_EQ(read_file(folder.path() / "real" / "report.json"), "second");
}

TEST(OutputFolder, WhatAKilledProgramLeftIsRemoved) {
  const TempFolder folder;
  const fs::path path = folder.path() / "out";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    OutputFolder out(path);
    out.write("report.json", "half");
    _exit(entries(folder.path()) == 1 ? 0 : 1);  // as a kill does: no destructor runs
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  EXPECT_EQ(entries(folder.path()), 1u);
  const OutputFolder living(path);
  make_output(path, "whole");
  EXPECT_EQ(entries(folder.path()), 2u) << "the output and the folder of the one that still runs";
  EXPECT_TRUE(fs::exists(living.working_path()));
}

}  // namespace
}  // namespace curvesup
