#pragma once

#include <string>
#include <vector>

#include "variolux/base/window.h"
#include "variolux/reconstruct/second_opinion.h"

namespace vlx {

/// A command in words: split at blanks; 'single' and "double" quotes keep them, and \ the next character
/// outside of single quotes. Throws Error when a quote is not closed or there is no word.
std::vector<std::string> wordsOf(const std::string& command);

/// Throws Error when a command has no words, does not name {color} and {output}, or has other {names} than
/// {albedo}, {normal} and {threads}.
void checkDenoiser(const std::string& command);

/// The command's program, looked up in PATH, and the files that its words name.
std::vector<std::string> denoiserFiles(const std::string& command);

/// Runs another denoiser three times, without a shell: on the means of all samples of the dump `input`, of
/// those of even and of odd number (edit/halves.h); once where no pixel has samples of both. In each word
/// {color}, {albedo}, {normal} are the PFM files, {output} the PFM that it is to write, and {threads} a
/// number, all processors where `threads` is 0. "oidn" is Open Image Denoise's own program oidnDenoise by its
/// best recipe: features, where there are any, are cleaned first, and the image is denoised with them. Files
/// lie in a temporary folder, which is removed. Throws Error, with what the command said last, when it fails
/// or writes no image of the samples' size; when it names a feature that the dump lacks.
SecondOpinion denoise(const std::string& command, const std::string& input, const Window& window,
                      int threads);

}  // namespace vlx
